#include "methods/time_freezing/instant_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr int kMaxInstants = 200;      // switches without time between them
constexpr int kMaxFrozen = 1'000'000;  // elements of one instant
// Part of the slip speed at which its direction is held: slower contacts come to rest with it.
constexpr double kTogether = 0.3;
// A bounce that rises by this many roundings of the gap is none.
constexpr double kLow = 4;
// An approach below this part of the largest is none.
constexpr double kNoApproach = 1e-12;

const RegionStep::Failure kHasNoMass{Status::inner_solver_failed, RegionStep::kNoMass};
const RegionStep::Failure kHasNoForces{Status::inner_solver_failed, RegionStep::kNoForces};

}  // namespace

InstantChange::InstantChange(const Problem& problem, const Options& options, const AuxiliaryDynamics& auxiliary,
                             ContactScales& scales, InstantSystem& system, RegionForces& forces, RegionStep& step,
                             const TimeLimit& time_limit, Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      options_(options),
      auxiliary_(auxiliary),
      scales_(scales),
      system_(system),
      forces_(forces),
      step_(step),
      time_limit_(time_limit),
      counters_(counters),
      law_(system, info_, auxiliary, scales, counters) {
  gap_ = Lambda_n_ = Vector::Zero(info_.n_c());
  Lambda_t_ = Vector::Zero(info_.n_lambda_t);
}

/// Contacts that touch: evaluates the system for them.
bool InstantChange::find_touching(RegionState& state, RegionSwitch cause) {
  problem_.gap(state.q.data(), gap_.data());
  state.touching.clear();
  for (const int i : info_.unilateral) {
    if (state.regions.of[i].is_held() || cause.is(SwitchKind::gap_closes, i) || gap_[i] <= scales_.touching(i))
      state.touching.push_back(i);
  }
  return system_.prepare(state.q, state.v, state.touching);
}

/// Records in the scales the speeds of contacts that touch; at the start of the run also the change of speed that the load
/// makes within a step.
void InstantChange::record_contacts(const RegionState& state, bool is_first) {
  const double H = options_.H;
  const Vector& load = system_.load();
  for (const int i : state.touching) {
    const double G_nn = system_.normal_delassus(i), G_tt = system_.tangential_delassus(i);
    scales_.record_contact(i, system_.normal(i), G_nn, G_tt);
    scales_.record_approach(i, system_.normal_terms(i, state.v));
    scales_.record_slip(i, system_.tangent_terms(i, state.v));
    if (G_nn > 0) scales_.record_force(i, system_.normal_terms(i, load) / G_nn);
    if (!is_first) continue;
    scales_.record_approach(i, H * system_.normal_terms(i, load));
    scales_.record_slip(i, H * (system_.tangent_terms(i, load) + info_.contacts[i].mu * scales_.force(i) * G_tt));
  }
}

/// Restitution, unless the bounce would be too low to be followed: (e J_n' v)^2 <= 2 |a| (rounding of the gap).
bool InstantChange::begins_to_bounce(const RegionState& state, int contact) const {
  const double eps_r = info_.contacts[contact].eps_r;
  if (eps_r == 0) return false;
  const double rebound = eps_r * system_.normal_velocity(contact, state.v), a = system_.load_rate(contact);
  return !(eps_r < 1 && a < 0 && rebound * rebound <= -2 * a * kLow * scales_.nearly_touching(contact));
}

/// Pushed and bouncing contacts. @return whether there are any: time is frozen
bool InstantChange::find_approaching(RegionState& state, RegionSwitch cause) {
  bool is_frozen = false;
  for (const int i : state.touching) {
    ContactRegion& region = state.regions.of[i];
    if (cause.ends(Region::bouncing, i)) region = {};
    const bool approaches =
        !cause.ends(Region::pushed, i) && system_.normal_velocity(i, state.v) < -kNoApproach * scales_.approach(i);
    if (region.region == Region::bouncing || (approaches && region.region == Region::pushed)) {
      is_frozen = true;
    } else if (approaches) {
      region.region = begins_to_bounce(state, i) ? Region::bouncing : Region::pushed;
      state.y[i] = 0;
      is_frozen = true;
    } else if (region.region == Region::pushed) {
      region.region = Region::sliding;
    }
  }
  return is_frozen;
}

RegionStep::Failure InstantChange::pass(RegionState& state, RegionSwitch cause, bool is_first) {
  Lambda_n_.setZero();
  Lambda_t_.setZero();
  for (int n = 0;; ++n) {
    if (n > kMaxInstants) return {Status::step_limit, fmt::format("impacts accumulate at t = {:.6g}", state.t)};
    if (!find_touching(state, cause)) return kHasNoMass;
    record_contacts(state, is_first);
    if (!find_approaching(state, cause)) break;
    if (law_.select_frozen(state.v, state.y, cause, state.regions, forces_) != LcpStatus::solved)
      return {Status::infeasible, "no auxiliary dynamics stop the approach"};
    if (const auto failure = pass_frozen(state, cause)) return failure;
  }
  if (law_.select_sliding(state.v, cause, state.regions, forces_) != LcpStatus::solved)
    return {Status::infeasible, "the contact law has no solution"};
  project_velocity(system_, state.regions, state.v);
  state.is_free = std::ranges::none_of(state.regions.of, [](const ContactRegion& region) { return region.is_held(); });
  return {};
}

RegionStep::Failure InstantChange::leave(RegionState& state) {
  if (state.is_free) return {};
  if (!forces_.solve(system_, auxiliary_, state.regions, state.v, state.y)) return kHasNoForces;
  step_.guess(state, options_.length);
  return {};
}

/// Length of the next frozen elements in pseudo time, which stops the fastest approach.
double InstantChange::frozen_length(const RegionState& state) const {
  double length = 0;
  bool has_limit = false;
  for (const int i : state.touching) {
    const ContactRegion& region = state.regions.of[i];
    has_limit = has_limit || region.region == Region::bouncing || region.turns;
    if (region.region == Region::pushed)
      length = std::max(length, -2 * system_.normal_velocity(i, state.v) / options_.a_n);
  }
  if (!has_limit) return length;
  return length > 0 ? std::min(length, options_.length) : options_.length;
}

/// Elements of pseudo time until a region changes.
RegionStep::Failure InstantChange::pass_frozen(RegionState& state, RegionSwitch& cause) {
  state.is_free = false;
  const double length = frozen_length(state);
  for (int n = 0; n < kMaxFrozen; ++n) {
    if (time_limit_.is_over()) return {Status::time_limit, time_limit_.message()};
    if (!forces_.solve(system_, auxiliary_, state.regions, state.v, state.y)) return kHasNoForces;
    step_.guess(state, length);
    cause = {};
    double taken = length;
    if (const auto failure = step_.take(state, taken, cause)) return failure;
    const RegionElement& element = step_.element();
    state.v = element.v1();
    state.y = element.y1();
    Lambda_n_ += element.Lambda_n();
    Lambda_t_ += element.Lambda_t();
    ++counters_.elements;
    if (cause.slows) {
      hold_direction(state, cause.contact);
      continue;
    }
    if (cause) return {};
    if (!system_.prepare(state.q, state.v, state.touching)) return kHasNoMass;
    turn_slip(system_, scales_, state, state.v, state.regions);
  }
  return {Status::step_limit, "the auxiliary dynamics do not end"};
}

void InstantChange::hold_direction(RegionState& state, int contact) {
  turn_slip(system_, scales_, state, state.v, state.regions);
  state.regions.of[contact].turns = false;
  double v_t[2];
  system_.slip_velocity(contact, state.v, v_t);
  law_.set_resting_speed(kTogether * std::hypot(v_t[0], v_t[1]));
}

RegionStep::Failure InstantChange::hold_slip(RegionState& state, int contact) {
  hold_direction(state, contact);
  if (!step_.renew_guess(state, options_.length)) return kHasNoForces;
  return {};
}

}  // namespace ricochet
