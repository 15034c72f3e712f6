#include "methods/event_driven/slow_slip.h"

#include <cmath>

namespace ricochet {

SlowSlip::SlowSlip(const Problem& problem, GroupRest& rest, ImpactSolver& law)
    : problem_(problem), rest_(rest), law_(law) {
  held_.reserve(problem.info().contacts.size());
}

void SlowSlip::restart(double tolerance) {
  quick_ = problem_.info().end_time / 10 * std::sqrt(2 * tolerance);
  row_ = 0;
  held_.clear();
}

void SlowSlip::count(const DetectedEvent& cause, double since) {
  if (since > quick_)
    row_ = 0;
  else if (cause.kind != SwitchKind::gap_closes)
    ++row_;
}

void SlowSlip::hold(std::vector<ImpactSolver::ClosedContact>& closed, const Vector& v, double low_speed) {
  held_.clear();
  for (auto& contact : closed) {
    if (!contact.slides) continue;
    double v_t[2]{0, 0};
    law_.slip_velocity(contact.contact, v, v_t);
    const double speed = std::hypot(v_t[0], v_t[1]);
    if (speed > low_speed) continue;
    held_.push_back({contact, speed * speed / law_.tangential_delassus(contact.contact)});
    contact.slides = false;
  }
}

bool SlowSlip::release_if(std::vector<ImpactSolver::ClosedContact>& closed, const auto& is_released) {
  const std::size_t n = held_.size();
  std::erase_if(held_, [&](const Held& held) {
    for (auto& contact : closed) {
      if (contact.contact != held.contact.contact || !is_released(contact)) continue;
      contact = held.contact;
      return true;
    }
    return false;
  });
  return held_.size() < n;
}

bool SlowSlip::release(std::vector<ImpactSolver::ClosedContact>& closed) {
  return release_if(closed, [](const auto& contact) { return is_slipping(contact.mode); });
}

bool SlowSlip::release_all(std::vector<ImpactSolver::ClosedContact>& closed) {
  return release_if(closed, [](const auto&) { return true; });
}

bool SlowSlip::is_explained(const Vector& q, const Vector& v, const Vector& v_plus) {
  if (held_.empty()) return true;
  double size = 0;
  for (const Held& held : held_) size += held.size;
  return rest_.is_explained(q, v, v_plus, size, held_.size());
}

}  // namespace ricochet
