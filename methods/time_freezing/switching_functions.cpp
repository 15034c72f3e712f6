#include "methods/time_freezing/switching_functions.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr double kSlowing = 1e-3;  // of the slip in space at the left end: from there on its direction is held

}  // namespace

SwitchingFunctions::SwitchingFunctions(const Problem& problem, const ButcherTableau& tableau,
                                       const AuxiliaryDynamics& auxiliary, const ContactScales& scales,
                                       InstantSystem& system, RegionForces& forces)
    : problem_(problem),
      info_(problem.info()),
      tableau_(tableau),
      auxiliary_(auxiliary),
      scales_(scales),
      system_(system),
      forces_(forces),
      gap_(Vector::Zero(info_.n_c())) {}

void SwitchingFunctions::begin(const RegionState& from, bool has_forces) {
  functions_.clear();
  end_regions_ = from.regions;
  problem_.gap(from.q.data(), gap_.data());
  needs_forces_ = false;
  const bool is_frozen = from.regions.is_frozen;
  for (const int i : info_.unilateral) {
    if (from.regions.of[i].is_held()) {
      add_held(i, from);
    } else if (!is_frozen || std::ranges::count(from.touching, i) > 0) {
      const double rounding = is_frozen ? kElementRounding * scales_.approach(i) : scales_.nearly_touching(i);
      functions_.push_back({.zero = {SwitchKind::gap_closes, i}, .rounding = rounding});
    }
  }
  if (needs_forces_ && !is_frozen && !has_forces && !forces_.solve(system_, auxiliary_, from.regions, from.v, from.y))
    needs_forces_ = false;
  for (Function& function : functions_) function.left = value(function, from, from.v, from.y);
}

double SwitchingFunctions::force_rounding(int contact, const Regions& regions) const {
  return regions.is_frozen ? auxiliary_.push[contact] : scales_.force(contact);
}

/// The functions of a contact that is held.
void SwitchingFunctions::add_held(int i, const RegionState& from) {
  const ContactRegion& region = from.regions.of[i];
  const auto add = [&](SwitchKind kind, double rounding, bool slows = false) {
    functions_.push_back({.zero = {kind, i, region.region, slows}, .rounding = rounding});
  };
  if (region.region == Region::sliding) {
    add(SwitchKind::force_vanishes, kElementRounding * force_rounding(i, from.regions));
    needs_forces_ = true;
  } else if (region.region == Region::pushed) {
    add(SwitchKind::force_vanishes, kElementRounding * scales_.approach(i));
  } else {
    add(SwitchKind::force_vanishes, 1e-13 * scales_.approach(i) / std::sqrt(auxiliary_.k));
  }
  if (region.sticks && region.region != Region::bouncing) {
    add(SwitchKind::cone_reached, kElementRounding * info_.contacts[i].mu * force_rounding(i, from.regions));
    needs_forces_ = true;
  } else if (region.slips()) {
    add(SwitchKind::slip_stops, kElementRounding * scales_.slip(i), region.turns);
  }
}

/// A function at a state whose system is prepared, with gap_ and forces_ of it.
double SwitchingFunctions::value(const Function& function, const RegionState& from, const Vector& v,
                                 const Vector& y) const {
  const int i = function.zero.contact;
  const ContactInfo& contact = info_.contacts[i];
  switch (function.zero.kind) {
    case SwitchKind::gap_closes:
      return from.regions.is_frozen ? system_.normal_velocity(i, v) : gap_[i];
    case SwitchKind::force_vanishes:
      if (function.zero.region == Region::pushed) return -system_.normal_velocity(i, v);
      return function.zero.region == Region::bouncing ? -y[i] : forces_.lambda_n[i];
    case SwitchKind::cone_reached: {
      const double* force = forces_.lambda_t.data() + contact.tangent_index;
      const double size = contact.n_t == 2 ? std::hypot(force[0], force[1]) : std::abs(force[0]);
      return contact.mu * std::abs(forces_.lambda_n[i]) - size;
    }
    case SwitchKind::slip_stops: {
      double v_t[2]{0, 0};
      system_.slip_velocity(i, v, v_t);
      const auto& d = from.regions.of[i].direction;
      const double along = v_t[0] * d[0] + (contact.n_t == 2 ? v_t[1] * d[1] : 0);
      if (!function.zero.slows || &v == &from.v) return along;
      return along - kSlowing * std::max(function.left, 0.0);
    }
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:  // there is no polygon
      break;
  }
  return 0;
}

bool SwitchingFunctions::evaluate(const RegionState& from, const RegionElement& element) {
  problem_.gap(element.q1().data(), gap_.data());
  if (!from.is_free) {
    if (!system_.prepare(element.q1(), element.v1(), from.touching)) return false;
    turn_slip(system_, scales_, from, element.v1(), end_regions_);
    if (needs_forces_ && !forces_.solve(system_, auxiliary_, end_regions_, element.v1(), element.y1())) return false;
  }
  for (Function& function : functions_) function.right = value(function, from, element.v1(), element.y1());
  return true;
}

SwitchingFunctions::Function* SwitchingFunctions::first_negative(RegionSwitch located) {
  Function* first = nullptr;
  double earliest = INFINITY;
  for (Function& function : functions_) {
    const double left = std::max(function.left, 0.0);
    if (located.is(function.zero.kind, function.zero.contact) || !(function.right < -function.rounding)) continue;
    const double theta = left / (left - function.right);
    if (theta >= earliest) continue;
    earliest = theta;
    first = &function;
  }
  return first;
}

bool SwitchingFunctions::cuts_dip(const RegionElement& element, RegionSwitch located, double& length) {
  for (int j = 0; j < tableau_.n_s; ++j) {
    const double c = tableau_.c[j];
    if (!(c > 0 && c < 1)) continue;
    problem_.gap(element.flight().q.col(j).data(), gap_.data());
    for (const Function& function : functions_) {
      if (located.is(function.zero.kind, function.zero.contact)) continue;
      if (!(gap_[function.zero.contact] < -function.rounding)) continue;
      length *= c;
      return true;
    }
  }
  return false;
}

void turn_slip(const InstantSystem& system, const ContactScales& scales, const RegionState& from, const Vector& v,
               Regions& regions) {
  for (const int i : from.touching) {
    if (!from.regions.of[i].turns) continue;
    double v_t[2];
    system.slip_velocity(i, v, v_t);
    const auto& left = from.regions.of[i].direction;
    const double speed = std::copysign(std::hypot(v_t[0], v_t[1]), v_t[0] * left[0] + v_t[1] * left[1]);
    if (std::abs(speed) > kElementRounding * scales.slip(i)) regions.of[i].direction = {v_t[0] / speed, v_t[1] / speed};
  }
}

}  // namespace ricochet
