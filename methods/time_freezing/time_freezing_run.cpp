#include "methods/time_freezing/time_freezing_run.h"

#include <algorithm>
#include <utility>

#include "methods/regions/until_run.h"

namespace ricochet {
namespace {

constexpr double kStandstill = 1e-14;  // of the end time: an element between switches at one time
constexpr int kMaxStandstills = 200;

}  // namespace

TimeFreezingRun::TimeFreezingRun(const Problem& problem, const ButcherTableau& tableau,
                                 const TimeFreezingOptions& options, const Settings& settings)
    : info_(problem.info()),
      options_(options),
      settings_(settings),
      T_(info_.end_time),
      H_(info_.end_time / settings.steps / options.n_fe),
      counters_(solution_.counters),
      time_limit_(settings.time_limit),
      auxiliary_(problem, options.a_n, options.bounce * info_.end_time),
      scales_(problem),
      system_(problem, counters_),
      forces_(info_),
      step_(problem, tableau, auxiliary_, scales_, system_, forces_, settings.inner_tolerance, counters_),
      change_(problem, {options.a_n, T_ / settings.steps, H_}, auxiliary_, scales_, system_, forces_, step_,
              time_limit_, counters_),
      state_{.q = info_.q0, .v = info_.v0, .y = Vector::Zero(info_.n_c()), .regions = {}, .touching = {}} {
  state_.regions.of.resize(info_.contacts.size());
}

bool TimeFreezingRun::fail(const RegionStep::Failure& failure) {
  solution_.status = failure.status;
  solution_.message = failure.message;
  return false;
}

ContactMode TimeFreezingRun::mode_of(int contact) const {
  const ContactRegion& region = state_.regions.of[contact];
  if (info_.contacts[contact].is_bilateral) return ContactMode::closed;
  if (!region.is_held()) return ContactMode::open;
  if (region.sticks) return ContactMode::stick;
  if (!region.slips()) return ContactMode::closed;
  return slip_mode(info_.contacts[contact].n_t, region.direction.data());
}

Solution TimeFreezingRun::run() {
  modes_.assign(info_.contacts.size(), ContactMode::open);
  for (const int i : info_.bilateral) modes_[i] = ContactMode::closed;
  scales_.begin_step(state_.q.data(), state_.v.data(), T_ / settings_.steps, true);
  bool is_going = pass_instant({}, true);
  if (settings_.recording >= Recording::events) solution_.initial_modes = modes_;
  for (int k = 1; k <= settings_.steps && is_going; ++k) {
    const double begin = (k - 1) * T_ / settings_.steps, end = k == settings_.steps ? T_ : k * T_ / settings_.steps;
    scales_.begin_step(state_.q.data(), state_.v.data(), T_ / settings_.steps, false);
    for (int n = 1; n <= options_.n_fe && is_going; ++n)
      is_going = advance(n == options_.n_fe ? end : begin + (end - begin) * n / options_.n_fe);
    if (!is_going) break;
    ++counters_.steps;
    if (settings_.recording >= Recording::grid) solution_.samples.push_back({state_.t, state_.q, state_.v, state_.v});
    if (ends_here(settings_, state_.t, state_.q, state_.v)) break;
  }
  solution_.t = state_.t;
  solution_.q = state_.q;
  solution_.v = state_.v;
  return std::move(solution_);
}

/// From the clock's t to `end`, through all switches between.
bool TimeFreezingRun::advance(double end) {
  for (int standstills = 0; state_.t < end;) {
    if (standstills > kMaxStandstills) return fail({Status::step_limit, "switches accumulate"});
    if (time_limit_.is_over()) return fail({Status::time_limit, time_limit_.message()});
    const double whole = end - state_.t;
    if (whole <= RegionStep::kShortest * T_) {
      state_.t = end;
      break;
    }
    double dt = whole;
    RegionSwitch cause;
    if (const auto failure = step_.take(state_, dt, cause)) return fail(failure);
    move(!cause && dt == whole ? end : std::min(state_.t + dt, end));
    standstills = dt <= kStandstill * T_ ? standstills + 1 : 0;
    const bool is_short_of_push = !state_.is_free && step_.element().is_short_of_push();
    step_.leave(static_cast<bool>(cause));
    if (cause) {
      if (!pass_instant(cause, false)) return false;
    } else if (is_short_of_push && !step_.renew_guess(state_, dt)) {
      return fail({Status::inner_solver_failed, RegionStep::kNoForces});
    }
  }
  return true;
}

/// The state becomes the right end of the last element.
void TimeFreezingRun::move(double t_end) {
  const RegionElement& element = step_.element();
  if (settings_.recording == Recording::motion && t_end > state_.t) element.add_motion(state_, t_end, solution_.motion);
  state_.t = t_end;
  state_.q = element.q1();
  state_.v = element.v1();
  if (info_.clock >= 0) {
    state_.q[info_.clock] = t_end;
    state_.v[info_.clock] = 1;
  }
  ++counters_.elements;
}

bool TimeFreezingRun::pass_instant(RegionSwitch cause, bool is_first) {
  if (cause.slows) {
    const auto failure = change_.hold_slip(state_, cause.contact);
    return !failure || fail(failure);
  }
  const std::vector<ContactMode> before = modes_;
  const Vector v_minus = state_.v;
  if (const auto failure = change_.pass(state_, cause, is_first)) return fail(failure);
  for (std::size_t i = 0; i < modes_.size(); ++i) modes_[i] = mode_of(static_cast<int>(i));
  record(before, v_minus, cause, is_first);
  const auto failure = change_.leave(state_);
  return !failure || fail(failure);
}

void TimeFreezingRun::record(const std::vector<ContactMode>& before, const Vector& v_minus, RegionSwitch cause,
                             bool is_first) {
  Vector Lambda_n = change_.Lambda_n();
  for (const int i : info_.unilateral) {
    const bool has_impulse = Lambda_n[i] > 0;
    if (!has_impulse) Lambda_n[i] = 0;
    const auto kind = event_kind(before[i], modes_[i], has_impulse, cause.is(SwitchKind::slip_stops, i));
    if (!kind || (is_first && !has_impulse)) continue;
    ++counters_.events;
    if (settings_.recording == Recording::final_state) continue;
    solution_.events.push_back(
        {state_.t, *kind, i, state_.q, v_minus, state_.v, Lambda_n, change_.Lambda_t(), modes_, {}});
  }
  if (settings_.recording >= Recording::grid && !is_first)
    solution_.samples.push_back({state_.t, state_.q, v_minus, state_.v});
}

}  // namespace ricochet
