#include "methods/time_freezing/region_step.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

// The functions of a switch are zero to this part of their rounding, unless the bracket is shorter than kShortest.
constexpr double kZero = 0.05;
constexpr int kMaxZeros = 60;  // evaluations of a bracket
constexpr int kMaxHalvings = 45;
constexpr int kMaxSwitches = 400;  // that an element is tried with

}  // namespace

RegionStep::RegionStep(const Problem& problem, const ButcherTableau& tableau, AuxiliaryDynamics& auxiliary,
                       const ContactScales& scales, InstantSystem& system, RegionForces& forces, double inner_tolerance,
                       Counters& counters)
    : problem_(problem),
      auxiliary_(auxiliary),
      scales_(scales),
      system_(system),
      forces_(forces),
      element_(problem, tableau, auxiliary, inner_tolerance, counters),
      functions_(problem, tableau, auxiliary, scales, system, forces) {}

bool RegionStep::renew_guess(const RegionState& state, double length) {
  if (state.is_free) {
    element_.forget_flight();
    return true;
  }
  if (!system_.prepare(state.q, state.v, state.touching)) return false;
  if (!forces_.solve(system_, auxiliary_, state.regions, state.v, state.y)) return false;
  element_.guess(state, forces_, length);
  return true;
}

/// Regions and functions of the left end. @return false where it has no system
bool RegionStep::begin(RegionState& state) {
  if (!state.is_free && !state.regions.is_frozen) {
    state.touching.clear();
    for (const int i : problem_.info().unilateral)
      if (state.regions.of[i].is_held()) state.touching.push_back(i);
    if (!has_system_ && !system_.prepare(state.q, state.v, state.touching)) return false;
    turn_slip(system_, scales_, state, state.v, state.regions);
  }
  element_.set_regions(state);
  functions_.begin(state, has_system_);
  return true;
}

/// The element of this length, and its functions.
bool RegionStep::reach(const RegionState& state, double length) {
  return element_.solve(state, length) && functions_.evaluate(state, element_);
}

RegionStep::Failure RegionStep::take(RegionState& state, double& length, RegionSwitch& cause) {
  if (!begin(state)) return {Status::inner_solver_failed, kNoMass};
  cause = {};
  int failures = 0;
  for (int n = 0; n < kMaxSwitches; ++n) {
    if (!reach(state, length)) {
      has_system_ = false;
      // In free flight there is no switch that a shorter element would end with.
      if (state.is_free || ++failures > kMaxHalvings / 4)
        return {Status::inner_solver_failed, "Newton's method did not converge"};
      length *= 0.5;
      if (!renew_guess(state, length)) return {Status::inner_solver_failed, kNoForces};
      continue;
    }
    auto* const first = functions_.first_negative(cause);
    if (!first && state.is_free && functions_.cuts_dip(element_, cause, length)) continue;
    if (!first) return {};
    if (!locate(state, *first, length)) {
      if (length > 0) return {Status::inner_solver_failed, "Newton's method did not converge at a switch"};
      cause = first->zero;  // it is at the left end
      element_.stay(state);
      return {};
    }
    cause = first->zero;
  }
  return {Status::step_limit, "too many switches in an element"};
}

/// For a function that is zero at the left end, too, the next zero is meant: halves the bracket until the function is
/// positive at its left end. Leaves the left end at 0 where it is positive nowhere. @return false without forces
bool RegionStep::find_positive(const RegionState& state, const SwitchingFunctions::Function& function,
                               Bracket& bracket) {
  double trial = bracket.b;
  for (int k = 0; k < kMaxHalvings; ++k) {
    trial *= 0.5;
    if (!reach(state, trial)) {
      if (!renew_guess(state, trial)) return false;
      continue;
    }
    if (function.right > 0) {
      bracket.a = trial;
      bracket.f_a = function.right;
      return true;
    }
    bracket.b = trial;
    bracket.f_b = function.right;
  }
  return true;
}

/// The zero of a function that is negative at the right end of an element of this length: the length becomes that of it.
bool RegionStep::locate(const RegionState& state, const SwitchingFunctions::Function& function, double& length) {
  Bracket bracket{.a = 0, .f_a = function.left, .b = length, .f_b = function.right};
  auto& [a, f_a, b, f_b] = bracket;
  if (!(f_a > function.rounding)) {
    if (!find_positive(state, function, bracket)) return false;
    if (a == 0) {  // there is none: the switch is at once
      length = 0;
      return false;
    }
  }
  // Regula falsi, with the value at an end that stays halved (Illinois).
  int side = 0;
  double x = b;
  for (int k = 0; k < kMaxZeros; ++k) {
    x = k % 8 == 7 ? 0.5 * (a + b) : (a * f_b - b * f_a) / (f_b - f_a);
    if (!(x > a && x < b)) x = 0.5 * (a + b);
    if (!reach(state, x)) {  // a stage too near to where slip has no direction: the zero is looked for before
      if (!renew_guess(state, x)) return false;
      b = x;
      f_b = std::min(f_b, -f_a);
      continue;
    }
    const double f = function.right;
    if (std::abs(f) <= kZero * function.rounding || b - a <= kShortest * problem_.info().end_time) break;
    if (f > 0) {
      a = x;
      f_a = f;
      if (side == 1) f_b *= 0.5;
      side = 1;
    } else {
      b = x;
      f_b = f;
      if (side == -1) f_a *= 0.5;
      side = -1;
    }
  }
  length = x;
  return true;
}

}  // namespace ricochet
