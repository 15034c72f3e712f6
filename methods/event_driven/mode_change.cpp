#include "methods/event_driven/mode_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/impact_laws/stated_impact.h"

namespace ricochet {

namespace {

// Roundings of a gap that a flight has to rise: a zero of the gap is looked for from one on.
constexpr double kLow = 4;
constexpr double kSoon = 1e-8;  // of the end time, of a difference of accelerations

}  // namespace

ModeChange::ModeChange(const Problem& problem, ContactScales& scales, ModeDynamics& dynamics, Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      scales_(scales),
      dynamics_(dynamics),
      law_(problem, FrictionPolygon(), scales, counters),
      impacts_(problem, scales, law_),
      group_(problem, scales, law_, impacts_,
             [this](std::span<const ContactMode> modes, Vector& q, Vector& v) {
               dynamics_.set_modes(modes, q.data(), v.data());
               return dynamics_.project(q.data(), v.data());
             }),
      slow_slip_(problem, impacts_.rest(), law_),
      modes_(problem.info().contacts.size(), ContactMode::open) {
  for (auto* list : {&touching_, &beginning_}) list->reserve(modes_.size());
  after_.reserve(modes_.size());
  closed_.reserve(modes_.size());
  Lambda_n_.setZero(info_.n_c());
  lambda_n_ = bias_ = gap_acceleration_ = Lambda_n_;
  Lambda_t_.setZero(info_.n_lambda_t);
  lambda_t_ = Lambda_t_;
  v_minus_.setZero(info_.n_q);
}

/// (1)
bool ModeChange::is_low(int contact, const Vector& q, const Vector& v_minus) {
  const double rate = law_.normal_velocity(contact, v_minus), eps_r = info_.contacts[contact].restitution(rate);
  if (!(eps_r > 0 && eps_r < 1)) return false;
  const double a = free_gap_acceleration(contact, q, v_minus);
  const double rebound = eps_r * rate;
  return a < 0 && rebound * rebound <= -2 * a * kLow * scales_.nearly_touching(contact);
}

double ModeChange::free_gap_acceleration(int contact, const Vector& q, const Vector& v) {
  law_.free_acceleration(q, v);
  return gap_acceleration(contact, q, v);
}

/// Gap acceleration under what ImpactSolver::acceleration() holds.
double ModeChange::gap_acceleration(int contact, const Vector& q, const Vector& v) {
  problem_.gap_acceleration_bias_of({&contact, 1}, q.data(), v.data(), bias_.data());
  return law_.normal_velocity(contact, law_.acceleration()) + bias_[contact];
}

/// Whether a contact that has just closed without an impact, at a rate that separates, does so by a hop that is lower
/// than rounding of its gap: such a rate is rounding, and time cannot resolve the hop.
bool ModeChange::hops(int contact, const Vector& q, const Vector& v) {
  const double rate = law_.normal_velocity(contact, v);
  return rate * rate <= 2 * std::abs(free_gap_acceleration(contact, q, v)) * kLow * scales_.nearly_touching(contact);
}

/// (2)
bool ModeChange::is_pressed_at_once(int contact, double a, const Vector& q, const Vector& v) {
  const double free = free_gap_acceleration(contact, q, v);
  const Vector w = law_.free_acceleration(q, v);
  const double dt = kSoon * info_.end_time;
  const double change = free_gap_acceleration(contact, q + dt * v, v + dt * w) - free;
  if (change >= -ContactScales::kStageRounding * law_.normal_velocity_scale(contact, w)) return false;
  const double jerk = change / dt;
  return a <= 0 || 2 * a * a * a <= 3 * jerk * jerk * kLow * scales_.nearly_touching(contact);
}

/// The touching contacts that do not separate. One that has closed without an impact may hop, and a bounce may be low.
void ModeChange::set_closed(const DetectedEvent& cause, const std::vector<ContactMode>* modes, const Vector& q,
                            const Vector& v, const std::vector<int>& stopped) {
  const bool is_impact = std::ranges::any_of(touching_, [&](int i) { return Lambda_n_[i] > 0; });
  double force[2]{0, 0};
  if (cause && cause.kind == SwitchKind::cone_reached) dynamics_.tangential_force(cause.contact, force);
  contacts_after_impact(law_, scales_, touching_,
                        {modes, v_minus_, v, is_impact, cause.kind, cause.contact, force, stopped}, after_);
  closed_.clear();
  for (const ContactAfterImpact& contact : after_) {
    const int i = contact.closed.contact;
    if (impacts_.is_left(i)) continue;
    const bool separates = contact.separates && !(cause.is(SwitchKind::gap_closes, i) && !is_impact && hops(i, q, v));
    if (contact.rests || !separates || (Lambda_n_[i] > 0 && is_low(i, q, v_minus_))) closed_.push_back(contact.closed);
  }
}

/// Takes idle contacts out of closed_, and forgets those that are idle no more.
void ModeChange::leave_idle(const DetectedEvent& cause, const Vector& q, const Vector& v) {
  std::erase_if(idle_, [&](int i) {
    return !std::ranges::binary_search(touching_, i) || Lambda_n_[i] > 0 || cause.is(SwitchKind::gap_closes, i) ||
           std::abs(law_.normal_velocity(i, v)) > scales_.no_drift(i);
  });
  if (idle_.empty() && closed_.size() < 2) return;
  const Vector& w = law_.free_acceleration(q, v);
  double load = 0;
  for (const int i : impacts_.candidates()) load = std::max(load, law_.normal_velocity_scale(i, w));
  no_acceleration_ = std::max(ContactScales::kStageRounding, scales_.redundant()) * load;
  std::erase_if(closed_, [&](const auto& closed) { return std::ranges::count(idle_, closed.contact) > 0; });
}

/// (3): adds to closed_ the idle contacts that the others do not hold.
bool ModeChange::add_pressed(const Vector& q, const Vector& v) {
  const std::size_t n = closed_.size();
  std::erase_if(idle_, [&](int i) {
    if (gap_acceleration(i, q, v) >= -no_acceleration_) return false;
    closed_.push_back({.contact = i});
    if (law_.contact(i).n_t > 0) law_.set_slide(closed_.back(), v, scales_.no_slip(i));
    return true;
  });
  std::ranges::sort(closed_, {}, [](const auto& closed) { return closed.contact; });
  return closed_.size() > n;
}

/// The contacts that have just lost their force, but do not part. They may sink.
void ModeChange::find_idle(const std::vector<ContactMode>& before, const Vector& q, const Vector& v) {
  if (closed_.empty() || !(scales_.redundant() > 0)) return;
  const auto stays = [&](int i) {
    return std::ranges::any_of(closed_, [&](const auto& c) { return c.contact == i && is_closed(c.mode); });
  };
  for (const int i : touching_) {
    if (!is_closed(before[i]) || stays(i) || std::abs(law_.normal_velocity(i, v)) > scales_.no_drift(i) ||
        std::abs(gap_acceleration(i, q, v)) > no_acceleration_)
      continue;
    if (std::ranges::count(idle_, i) == 0) idle_.push_back(i);
  }
}

ModeChange::Outcome ModeChange::failed(Status status, FailureCode code, const std::string& what, int contact) const {
  const std::string& name = info_.contacts[contact].name;
  return {status, fmt::format("{} at contact '{}'", what, name), {code, {name}}, false};
}

/// Names the contacts that still approach after many impacts at one instant, with their rates.
ModeChange::Outcome ModeChange::accumulated(int n_impacts, const Vector& v) const {
  Outcome outcome{Status::step_limit, {}, {FailureCode::impacts_accumulate, {}}};
  std::string names;
  for (const int i : impacts_.approaching()) {
    const std::string& name = info_.contacts[i].name;
    names += fmt::format("{}'{}' ({:.3g} m/s)", names.empty() ? "" : ", ", name, law_.normal_velocity(i, v));
    outcome.reason.contacts.push_back(name);
  }
  outcome.message = fmt::format("impacts accumulate, {} of them at this instant: {}", n_impacts, names);
  return outcome;
}

ModeChange::Outcome ModeChange::decide(const DetectedEvent& cause, const std::vector<ContactMode>* modes, Vector& q,
                                       Vector& v, const std::vector<int>& stopped) {
  if (modes) modes_ = *modes;
  if (!modes) {
    group_.restart();
    idle_.clear();
  }
  group_.begin();
  const std::vector<ContactMode>* before = modes ? &modes_ : nullptr;
  Lambda_n_.setZero();
  Lambda_t_.setZero();
  touching_.clear();
  impacts_.find_touching(q, before, touching_);
  if (cause && cause.kind == SwitchKind::gap_closes) impacts_.add_touching(cause.contact, touching_);
  v_minus_ = v;
  Outcome outcome;
  if (!touching_.empty() || info_.has_bilateral()) {
    if (!law_.prepare(q, impacts_.candidates()))
      return {Status::inner_solver_failed,
              "M is not positive definite, or bilateral constraints depend on each other",
              {},
              false};
  }
  if (!touching_.empty()) {
    impacts_.record_touching(v);
    if (!modes) impacts_.record_load(q, v, info_.end_time / 10);
    const auto impacts = impacts_.apply_impacts(q, before, touching_, v, Lambda_n_, Lambda_t_);
    switch (impacts.result) {
      case ImpactSequence::Result::done:
        break;
      case ImpactSequence::Result::no_impulse:
        return failed(Status::infeasible, FailureCode::inconsistent,
                      "the impact law has no solution: " + why_no_impulse(info_), impacts.failed_contact);
      case ImpactSequence::Result::no_forces:
        return failed(Status::infeasible, FailureCode::inconsistent, "the contact law has no solution",
                      impacts.failed_contact);
      case ImpactSequence::Result::accumulates:
        return accumulated(impacts.n_impacts, v);
    }
    outcome.has_impact = impacts.n_impacts > 0;
    const bool settles = outcome.has_impact || (cause && cause.kind == SwitchKind::gap_closes);
    const bool is_at_rest = settles && group_.apply({.contact = cause.contact, .has_sunk = cause.level > 0}, before,
                                                    v_minus_, touching_, q, v);
    outcome.raises = outcome.has_impact && !is_at_rest && group_.raise_sunk(touching_, q, v);
    group_.accept();
  }
  if (slow_slip_.makes_no_progress()) return no_progress();
  const bool may_hold = touching_.size() > 1 && slow_slip_.is_followed_enough();
  outcome = close(cause, before, outcome, q, v, stopped, may_hold);
  group_.add_left(v);
  may_sink_ = group_.refused();
  may_sink_.insert(may_sink_.end(), idle_.begin(), idle_.end());
  return outcome;
}

/// Names the contacts that slip, with their velocities.
ModeChange::Outcome ModeChange::no_progress() const {
  Outcome outcome{Status::step_limit, {}, {FailureCode::not_stated, {}}};
  std::string names;
  for (const int i : touching_) {
    if (info_.contacts[i].n_t == 0 || modes_[i] == ContactMode::stick) continue;
    double v_t[2]{0, 0};
    law_.slip_velocity(i, v_minus_, v_t);
    const std::string& name = info_.contacts[i].name;
    names += fmt::format("{}'{}' (slip {:.3g} m/s, gap rate {:.3g} m/s)", names.empty() ? "" : ", ", name,
                         std::hypot(v_t[0], v_t[1]), law_.normal_velocity(i, v_minus_));
    outcome.reason.contacts.push_back(name);
  }
  outcome.message = fmt::format("contacts stick, slip and part in turn {} times without progress in time: {}",
                                slow_slip_.row(), names);
  return outcome;
}

/// The forces and modes of closed_: of contacts with slow slip those that stick, if that is consistent. False where
/// the contact law has no solution.
bool ModeChange::find_forces(const Vector& q, const Vector& v) {
  do {
    do {
      const bool is_solved = (closed_.empty() && idle_.empty()) ||
                             law_.contact_forces(q, v, closed_, lambda_n_, lambda_t_) == LcpStatus::solved;
      if (!is_solved && !slow_slip_.release_all(closed_)) return false;
      if (is_solved && !slow_slip_.release(closed_)) break;
    } while (true);
  } while (group_.leave_wedge(closed_, lambda_n_) || add_pressed(q, v));
  return true;
}

/// Sets in the dynamics which contacts stay closed after the impacts, and moves (q, v) to where they have no gap and rate.
/// @param may_hold  whether slow slip may count as rest
ModeChange::Outcome ModeChange::close(const DetectedEvent& cause, const std::vector<ContactMode>* before,
                                      Outcome outcome, Vector& q, Vector& v, const std::vector<int>& stopped,
                                      bool may_hold) {
  std::vector<ContactMode>& next = modes_;
  if (may_hold) modes_held_ = modes_;
  beginning_.clear();
  closed_.clear();
  if (!touching_.empty()) {
    set_closed(cause, before, q, v, stopped);
    leave_idle(cause, q, v);
    for (const auto& closed : closed_) {
      if (!closed.slides || law_.sliding_delassus(closed.contact, closed.direction) > 0) continue;
      return failed(Status::infeasible, FailureCode::painleve, "Painleve's paradox: slip pulls the bodies together",
                    closed.contact);
    }
    slow_slip_.hold(closed_, v, may_hold ? impacts_.rest().low_speed(q, v, impacts_.candidates()) : -1);
    if (!find_forces(q, v))
      return failed(Status::infeasible, FailureCode::inconsistent, "the contact law has no solution",
                    closed_.empty() ? idle_.front() : closed_.front().contact);
    for (const auto& closed : closed_) gap_acceleration_[closed.contact] = law_.gap_acceleration(closed.contact);
    law_.decide_unloaded(q, v, closed_, lambda_n_, lambda_t_);
  }
  for (auto& closed : closed_) {
    if (closed.mode == ContactMode::open && info_.contacts[closed.contact].n_t == 0 &&
        is_pressed_at_once(closed.contact, gap_acceleration_[closed.contact], q, v))
      closed.mode = ContactMode::closed;
  }
  if (before) find_idle(*before, q, v);
  for (int i = 0; i < info_.n_c(); ++i)
    next[i] = info_.contacts[i].is_bilateral ? ContactMode::closed : ContactMode::open;
  if (!touching_.empty()) {
    for (const auto& closed : closed_) {
      next[closed.contact] = closed.mode;
      if (is_closed(closed.mode))
        scales_.record_force(closed.contact, law_.load_size(closed.contact) / law_.normal_delassus(closed.contact));
    }
  }
  dynamics_.set_modes(next, q.data(), v.data());
  if (touching_.empty()) return outcome;
  dynamics_.set_forces(lambda_n_, lambda_t_);
  for (const auto& closed : closed_) {
    const int i = closed.contact;
    if (closed.mode != ContactMode::slip || (closed.slides && !cause.is(SwitchKind::cone_reached, i))) continue;
    const auto& contact = info_.contacts[i];
    const auto force = lambda_t_.segment(contact.tangent_index, 2);
    const double d[2]{-force[0] / force.norm(), -force[1] / force.norm()};
    dynamics_.hold_direction(i, d);
    beginning_.push_back(i);
  }
  if (may_hold) {
    q_held_ = q;
    v_held_ = v;
  }
  if (!dynamics_.project(q.data(), v.data()))
    return {Status::inner_solver_failed, ModeDynamics::kUndetermined, {}, outcome.has_impact};
  if (may_hold && !slow_slip_.is_explained(q_held_, v_held_, v)) {
    q = q_held_;
    v = v_held_;
    modes_ = modes_held_;
    return close(cause, before, outcome, q, v, stopped, false);
  }
  if (may_hold && slow_slip_.has_held()) {  // which may have turned the slip of the other contacts
    outcome.holds_slow_slip = true;
    const bool leaves = cause.kind == SwitchKind::force_vanishes;
    return close(leaves ? cause : DetectedEvent(), &modes_, outcome, q, v, {}, false);
  }
  return outcome;
}

}  // namespace ricochet
