#include "methods/event_driven/event_driven_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "methods/contact_laws/bernstein.h"

namespace ricochet {
namespace {

constexpr double kLanding = 0.01;          // of the tolerance, (2)
constexpr double kShortest = 1e-14;        // of the end time: what time can resolve
constexpr double kShortestRefined = 1e-6;  // of the end time: step that becomes shorter for a gap that it nearly closes
constexpr int kMaxStandstills = 100;       // a few events may coincide
constexpr int kFewStandstills = 4;         // after which a contact that opens or closes may sink
constexpr int kMaxLandings = 8;
constexpr double kLater = 1e-9;  // of a step: to where find() locates its event
constexpr long kMaxSteps = 10'000'000;
constexpr long kStepsPerMark = 100'000;   // steps between two looks at the progress
constexpr double kLeastProgress = 1e-5;   // of the end time, between these
constexpr double kSlipStart = 0.01;       // of the end time: first length of slip from rest in space
constexpr double kShortestStart = 1e-12;  // the same, least
constexpr int kMaxSlipStarts = 200;       // tries and steps, until explicit ones go on
constexpr double kExplicit = 2;           // part of the slip velocity that friction may change in a step of theirs
constexpr double kHeldStart = 0.05;       // of end_time and the cube root of the tolerance: step with held directions
constexpr int kMaxTurns = 30;             // iterations for these
constexpr double kOfTolerance = 0.1;      // error that ends a slip in space early

}  // namespace

EventDrivenRun::EventDrivenRun(const Problem& problem, const Settings& settings, const StepFormula& formula,
                               const CaptureHeight& capture_height, EventDrivenWorkspace& workspace, int n_samples)
    : problem_(problem),
      info_(problem.info()),
      settings_(settings),
      tolerance_(settings.tolerance),
      T_(problem.info().end_time),
      n_samples_(settings.recording >= Recording::grid ? n_samples : 0),
      time_limit_(settings.time_limit),
      counters_(workspace.counters),
      scales_(workspace.scales),
      dynamics_(workspace.dynamics),
      functions_(workspace.functions),
      mode_change_(workspace.mode_change),
      step_(*workspace.step),
      ends_(step_.ends),
      before_(info_.contacts.size(), ContactMode::open),
      v_minus_(info_.v0),
      check_(problem, StepCheck::kTolerances * tolerance_),
      border_(problem, settings),
      progress_(info_, kStepsPerMark, kLeastProgress),
      spans_(problem),
      groups_(problem.info()),
      control_(step_.error_order, step_.kept_growth) {
  workspace.start(problem, tolerance_, capture_height);
  mode_change_.restart(tolerance_);
  if (settings.sensitivities.empty()) return;
  sensitivity_.emplace(problem, std::get<EmbeddedTableau>(formula), scales_, dynamics_, settings);
  mode_change_.keep_impacts(&impacts_);
}

bool EventDrivenRun::stop(Status status, const std::string& message, FailureReason reason) {
  solution_.status = status;
  solution_.reason = std::move(reason);
  solution_.message = fmt::format("at t = {:.6g} s: {}", settings_.begin + t_, message);
  return false;
}

bool EventDrivenRun::stop_undetermined() {
  return stop(Status::inner_solver_failed, ModeDynamics::kUndetermined);
}

double EventDrivenRun::slip_speed(int contact) {
  double v_t[2]{0, 0};
  functions_.slip_velocity(contact, ends_.q0.data(), ends_.v0.data(), v_t);
  return std::hypot(v_t[0], v_t[1]);
}

/// Ends the run with the function or the error that made its steps short.
bool EventDrivenRun::stop_too_short() {
  const int contact = shortened_by_ ? shortened_by_.contact : functions_.slowest_slip(ends_.v0);
  if (contact < 0)
    return stop(Status::inner_solver_failed,
                "the steps become too short: their error estimate stays above the tolerance");
  const std::string& name = info_.contacts[contact].name;
  const auto message = [&](const std::string& what) {
    return stop(Status::inner_solver_failed, fmt::format("the steps become too short: {} at contact '{}'", what, name),
                {FailureCode::not_stated, {name}});
  };
  if (!shortened_by_)
    return message(
        fmt::format("the error estimate stays above the tolerance, with slip of {:.3g} m/s", slip_speed(contact)));
  switch (shortened_by_.kind) {
    case SwitchKind::gap_closes:
      return message("the gap closes too flatly to be located");
    case SwitchKind::force_vanishes:
      return message("the normal force vanishes too flatly to be located");
    case SwitchKind::cone_reached:
      return message("the friction force reaches its bound too flatly to be located");
    case SwitchKind::slip_stops:
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:
      break;
  }
  return message("slip stops too flatly to be located");
}

/// Ends the run where events at one time have no end.
bool EventDrivenRun::stop_accumulation(const DetectedEvent& cause) {
  const int i = cause ? cause.contact : functions_.slowest_slip(ends_.v0);
  if (i < 0) return stop(Status::step_limit, "events accumulate");
  const auto& contact = info_.contacts[i];
  const auto what = [&] {
    switch (cause ? cause.kind : SwitchKind::slip_stops) {
      case SwitchKind::gap_closes:
        return "its gap closes and opens in turn";
      case SwitchKind::force_vanishes:
        return "its normal force vanishes and returns in turn";
      default:
        return "it sticks and slips in turn";
    }
  };
  const std::string slip = contact.n_t > 0 ? fmt::format(", slip {:.3g} m/s", slip_speed(i)) : "";
  return stop(Status::step_limit, fmt::format("events accumulate at contact '{}': {}{}", contact.name, what(), slip),
              {FailureCode::not_stated, {contact.name}});
}

/// The next try has length h [s]. @param cause  why; none: the error
void EventDrivenRun::shorten(double h, const DetectedEvent& cause) {
  h_ = h;
  shortened_by_ = cause;
  control_.reject();
}

/// The acceleration at the left end, and the forces there.
bool EventDrivenRun::accelerate() {
  return dynamics_.accelerate(ends_.q0.data(), ends_.v0.data(), ends_.a0.data()) || stop_undetermined();
}

Solution EventDrivenRun::solve() {
  if (begin()) {
    while (!ends_here() && t_ < T_ && take_step()) {
    }
  }
  if (solution_.succeeded() && info_.has_bilateral()) dynamics_.project(ends_.q0.data(), ends_.v0.data());
  solution_.t = t_;
  solution_.q = ends_.q0;
  solution_.v = ends_.v0;
  counters_.elements = counters_.steps;
  solution_.counters = counters_;
  if (sensitivity_) sensitivity_->finish(ends_.q0, ends_.v0, ends_.a0, solution_);
  return std::move(solution_);
}

/// Whether Settings::ends holds after the last step, or at the start.
bool EventDrivenRun::ends_here() const {
  return settings_.ends && settings_.ends(solution_, dynamics_.modes());
}

bool EventDrivenRun::begin() {
  ends_.q0 = info_.q0;
  ends_.v0 = info_.v0;
  scales_.begin_step(ends_.q0.data(), ends_.v0.data(), T_ / 10, true);
  if (!change_modes({})) return false;
  if (border_.is_watched()) solution_.exit.function = border_.left_by_jump(info_.q0, info_.v0, ends_.v0);
  if (solution_.exit.function >= 0) return false;
  h_ = first_length(step_, dynamics_, tolerance_, T_);
  return true;
}

bool EventDrivenRun::take_step() {
  if (time_limit_.is_over()) return stop(Status::time_limit, time_limit_.message());
  if (counters_.steps >= kMaxSteps) return stop(Status::step_limit, fmt::format("{} steps", kMaxSteps));
  if (progress_.is_passed(counters_.steps, t_)) return stop(Status::step_limit, progress_.message(dynamics_.modes()));
  const double rest = T_ - t_, allowed = std::min(h_, spans_.longest_step(t_, h_, ends_.q0, ends_.v0));
  const bool is_last = 1.01 * allowed >= rest;
  const double h = is_last ? rest : allowed;
  if (h < kShortest * T_ && !is_last) return stop_too_short();
  functions_.begin_step();
  EventFunctions* const watched = functions_.has_forces() ? &functions_ : nullptr;
  double e = step_.take(h, watched) ? step_.error(tolerance_) : std::numeric_limits<double>::infinity();
  if (sensitivity_ && e <= 1) e = std::max(e, sensitivity_->take(ends_, h));
  if (!StepControl::accepts(e)) {
    shorten(h * control_.factor_of_rejected(e), {});
    return true;
  }
  const double next = control_.next(h, e);
  if (!is_last || next > h_) h_ = next;
  if (!step_.finish()) return stop_undetermined();
  DetectedEvent event = info_.n_c() > 0 ? functions_.find(ends_) : DetectedEvent();
  if (event) {
    double until = h;
    if (!reach_first(event, until)) {
      shorten(0.5 * h, event);
      return true;
    }
    if (until > 0 && leaves_region(until)) return false;
    ++counters_.steps;
    if (event.duration > 0) h_ = std::min(h_, std::max(event.duration, 2 * kShortest * T_));
    if (!land(until)) return false;
    if (settle_slip(event)) return true;
    if (!solution_.succeeded() || solution_.exit.function >= 0 || !change_modes(event)) return false;
    if (border_.is_watched()) solution_.exit.function = border_.outside(ends_.q0, ends_.v0);  // v has jumped
    return solution_.exit.function < 0;
  }
  if (info_.n_c() > 0 && h > kShortestRefined * T_ && !functions_.is_exact()) {
    shorten(0.5 * h, functions_.inexact());
    return true;
  }
  if (leaves_region(h)) return false;
  ++counters_.steps;
  const double end = is_last ? T_ : t_ + h;
  record_motion(end);
  if (!sample_until(end)) return false;
  t_ = end;
  if (!check_step()) return false;
  if (sensitivity_) sensitivity_->accept();
  ends_.advance();
  if (info_.n_c() > 0) functions_.advance(ends_.v0);
  if (settings_.recording >= Recording::grid && n_samples_ == 0)
    solution_.samples.push_back({t_, ends_.q0, ends_.v0, ends_.v0});
  return solution_.succeeded();
}

/// Whether the step at hand, of length h [s], leaves the region.
bool EventDrivenRun::leaves_region(double h) {
  return border_.is_left(
      h,
      [&](double s, Vector& q, Vector& v) {
        q = s < 1 ? ends_.q0 : ends_.q1;
        v = s < 1 ? ends_.v0 : ends_.v1;
        if (s > 0 && s < 1) ends_.interpolate(s, q, v);
      },
      solution_.exit);
}

/// The last check of the step at hand.
bool EventDrivenRun::check_step() {
  const Status status = check_(ends_.q0, ends_.q1, ends_.v1, dynamics_.modes());
  if (status != Status::success) return stop(status, check_.message());
  const int contact = functions_.sunk(ends_.q1.data());
  return contact < 0 || stop(Status::infeasible, fmt::format("bodies pass through each other at contact '{}'",
                                                             info_.contacts[contact].name));
}

/// A step to the first event. One that is met later than it has been found, as a grazing contact is, may come after
/// another one. @param event  in and out @param h  of the step in which it has been found, out: to the event [s]
/// @return false where none is reached
bool EventDrivenRun::reach_first(DetectedEvent& event, double& h) {
  for (int k = 0; k < kMaxLandings; ++k) {
    const double found = event.theta * h;
    h = found;
    if (!reach(event, h)) return false;
    if (h <= (1 + kLater) * found) return true;
    ends_.h = h;
    functions_.begin_step();
    const DetectedEvent other = functions_.find(ends_);
    if (!other || other.theta >= 1 - kLater) return true;
    event = other;
  }
  return false;
}

/// A step of length h [s] to the event. @return false where (2) does not come to hold
bool EventDrivenRun::reach(DetectedEvent& event, double& h) {
  if (!(h > 0)) return true;
  for (int k = 0; k < kMaxLandings; ++k) {
    if (!step_.take(h, nullptr) || !step_.finish()) return false;
    if (event.level > 0) return true;  // any place near that level does
    const double jerk = (ends_.a1 - ends_.a0).lpNorm<Eigen::Infinity>() / h;
    event.slope = functions_.slope(event, ends_.q1.data(), ends_.v1.data());
    const double dt = -functions_.value(event, ends_.q1.data(), ends_.v1.data()) / event.slope;
    const bool holds = dt * dt * (ends_.a1.lpNorm<Eigen::Infinity>() + jerk) <= kLanding * tolerance_;  // (2)
    if (!(dt > -h)) return holds;  // before the left end
    if (!holds || dt >= h) {
      h += dt;
      continue;
    }
    double moved = dt;
    for (int taylor = 0; taylor < 3; ++taylor) {
      ends_.q1 += moved * ends_.v1 + 0.5 * moved * moved * ends_.a1;
      ends_.v1 += moved * ends_.a1;
      h += moved;
      const double left = functions_.value(event, ends_.q1.data(), ends_.v1.data());
      moved = -left / event.slope;
      if (std::abs(moved) <= 1e-16 * (t_ + h) || std::abs(moved) > std::abs(dt)) break;
    }
    return true;
  }
  return false;
}

/// The left end becomes the right one, at the event.
bool EventDrivenRun::land(double h) {
  if (h > 0) {
    if (sensitivity_) {
      if (!std::isfinite(sensitivity_->take(ends_, h))) return stop_undetermined();
      sensitivity_->accept();
    }
    ends_.h = h;
    record_motion(t_ + h);
    if (!sample_until(t_ + h)) return false;
    t_ += h;
    if (!check_step()) return false;
    ends_.q0 = ends_.q1;
    ends_.v0 = ends_.v1;
  }
  if (info_.clock >= 0) ends_.q0[info_.clock] = info_.start_time() + t_;
  // Forces at the event, for the decision.
  return (dynamics_.closed().empty() && !sensitivity_) || accelerate();
}

/// The last v_stop of slip in space. It ends
///
///   on a straight line, with the acceleration held, where that passes zero within the tolerance       (3)
///   or where the contact law lets it stick, with all contacts that are as slow: their slip then decreases to zero
///   in the norm of W^-1 whatever its direction, since friction outweighs the load, u' W^-1 u' <= -(mu lambda_n - |lambda_t|) |u|,
///   and what it still turns moves the state by less than the tolerance.
///
/// True where it does neither, and the step goes on: with half of the speed for the next v_stop.
bool EventDrivenRun::settle_slip(const DetectedEvent& event) {
  stopped_.clear();
  if (event.kind != SwitchKind::slip_stops || info_.contacts[event.contact].n_t != 2) return false;
  const auto rest = functions_.rest(event.contact, ends_.q0, ends_.v0, ends_.a0);
  const double of_q = kOfTolerance * tolerance_ * (1 + ends_.q0.lpNorm<Eigen::Infinity>()),
               of_v = kOfTolerance * tolerance_ * (1 + ends_.v0.lpNorm<Eigen::Infinity>());
  const double dt = std::clamp(rest.duration, 0.0, T_ - t_);
  const auto move = [&](double h) {
    ends_.q1 = ends_.q0 + h * ends_.v0 + 0.5 * h * h * ends_.a0;
    ends_.v1 = ends_.v0 + h * ends_.a0;
    return true;
  };
  const bool is_straight = rest.duration > 0 && rest.distance <= of_v;
  if (!is_straight) functions_.find_slow(event.contact, ends_.q0, ends_.v0, stopped_);
  if (!is_straight && rest.speed > scales_.no_slip(event.contact)) {
    bool stops = rest.speed * rest.turning_time <= of_q;
    if (stops) {
      move(dt);
      before_ = dynamics_.modes();
      const Vector law = dynamics_.law_forces();
      scales_.begin_step(ends_.q0.data(), ends_.v0.data(), T_ / 10, false);
      const auto outcome = mode_change_.decide(event, &before_, ends_.q1, ends_.v1, stopped_);
      stops = outcome.status == Status::success &&
              std::ranges::all_of(stopped_, [&](int i) { return dynamics_.modes()[i] == ContactMode::stick; });
      dynamics_.set_modes(before_, ends_.q0.data(), ends_.v0.data());
      dynamics_.set_law_forces(law);
      if (!accelerate()) return false;
    }
    if (!stops) {
      return pass_slip(event);
    }
  }
  if (!(dt > 0)) return false;
  if (sensitivity_) sensitivity_->move_at_constant_acceleration(ends_.q0, ends_.v0, ends_.a0, dt);
  sample_until(t_ + dt, move);
  move(dt);
  ends_.h = dt;
  ends_.a1 = ends_.a0;
  ends_.collocation = nullptr;
  record_motion(t_ + dt);
  ends_.q0 = ends_.q1;
  ends_.v0 = ends_.v1;
  t_ += dt;
  return false;
}

/// Slip in space that has slowed down to v_stop goes on, unless it counts as rest in a group. False where the run ends.
bool EventDrivenRun::pass_slip(const DetectedEvent& event) {
  if (dynamics_.closed().size() > 1) {
    mode_change_.count(event, t_ - std::exchange(last_pass_, t_));
    if (mode_change_.holds_slow_slip() && !change_modes({})) return false;
  }
  if (dynamics_.modes()[event.contact] == ContactMode::slip) functions_.pass_slip(event.contact, ends_.q0, ends_.v0);
  return true;
}

bool EventDrivenRun::change_modes(const DetectedEvent& cause) {
  const bool is_first = last_event_ < 0;
  before_ = dynamics_.modes();
  v_minus_ = ends_.v0;
  scales_.begin_step(ends_.q0.data(), ends_.v0.data(), T_ / 10, false);
  impacts_.clear();
  if (sensitivity_) {
    if (const auto reason = sensitivity_->reach(cause, ends_.q0, ends_.v0, ends_.a0))
      return stop(Status::infeasible, *reason);
  }
  if (!is_first) mode_change_.count(cause, t_ - last_event_);
  const auto outcome = mode_change_.decide(cause, is_first ? nullptr : &before_, ends_.q0, ends_.v0, stopped_);
  stopped_.clear();
  if (outcome.status != Status::success) return stop(outcome.status, outcome.message, outcome.reason);
  if (sensitivity_ && (mode_change_.groups().capture.n_contacts > 0 || outcome.raises || outcome.holds_slow_slip))
    return stop(Status::infeasible, "no derivatives pass contacts that come to rest as a group");
  if (is_first) {
    for (auto& mode : before_) mode = ContactMode::open;
    solution_.initial_modes = dynamics_.modes();
  }
  const bool is_soon = t_ - last_event_ <= kShortest * T_;
  const bool changes = outcome.has_impact || before_ != dynamics_.modes();
  const bool stands_still = cause && is_soon && (!changes || standstills_ >= kFewStandstills);
  if (stands_still && (cause.kind == SwitchKind::gap_closes || cause.kind == SwitchKind::force_vanishes))
    functions_.let_sink(cause.contact);
  for (const int i : mode_change_.may_sink()) functions_.let_sink(i);
  standstills_ = is_soon ? standstills_ + 1 : 0;
  last_event_ = t_;
  if (!groups_.add(t_, mode_change_.groups(), solution_))
    return stop(Status::step_limit, groups_.message(settings_.begin), groups_.reason());
  if (standstills_ > kMaxStandstills) return stop_accumulation(cause);
  record(cause, outcome.has_impact ? v_minus_ : ends_.v0);
  if (sensitivity_ && !vary_event()) return false;
  if (!mode_change_.beginning().empty() && t_ < T_ && !start_slip()) return false;
  if (!accelerate()) return false;
  if (info_.n_c() == 0) return true;
  functions_.begin(ends_.q0.data(), ends_.v0.data());
  const int contact = functions_.contradicted();
  // Slow slip may have turned where the state has been moved: the laws are applied once more to that state.
  const bool may_have_turned = contact >= 0 && functions_.slowest_slip(ends_.v0) >= 0;
  if (may_have_turned && standstills_ < kFewStandstills) return change_modes({});
  return contact < 0 || stop(Status::inner_solver_failed, fmt::format("the force of contact '{}' contradicts its mode",
                                                                      info_.contacts[contact].name));
}

/// The derivatives go through what has happened.
bool EventDrivenRun::vary_event() {
  if (!accelerate()) return false;
  auto reason = sensitivity_->apply_impacts(impacts_, before_, ends_.q0);
  if (!reason) reason = sensitivity_->leave(before_, ends_.q0, ends_.v0, ends_.a0);
  return !reason || stop(Status::infeasible, *reason);
}

/// The first moments of slip in space from rest, by SlipStart: steps of which two halves agree with the whole within the
/// tolerance, until explicit steps are no shorter.
bool EventDrivenRun::start_slip() {
  const auto& contacts = mode_change_.beginning();
  if (sensitivity_) return start_slip_at_held_directions();
  if (!slip_start_) slip_start_.emplace(problem_, dynamics_, functions_);
  Vector angles(static_cast<Eigen::Index>(contacts.size()));
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    double d[2];
    dynamics_.direction(contacts[k], d);
    angles[static_cast<Eigen::Index>(k)] = std::atan2(d[1], d[0]);
  }
  double h = std::min(kSlipStart * T_, T_ - t_);
  const auto finish = [&] {
    for (const int i : contacts) dynamics_.hold_direction(i, nullptr);
    h_ = std::min(h_, h);
    return true;
  };
  functions_.begin(ends_.q0.data(), ends_.v0.data());
  for (int k = 0; k < kMaxSlipStarts; ++k) {
    if (time_limit_.is_over()) return stop(Status::time_limit, time_limit_.message());
    const double left = T_ - t_;
    const bool is_last = h >= left;
    if (is_last) h = left;
    if (h < kShortestStart * T_ && !is_last) {
      slip_start_->hold(contacts, angles);
      return hold_directions(contacts, std::min(harmless_length(contacts), left), false);
    }
    ++counters_.steps;
    Vector q_once = ends_.q0, v_once = ends_.v0, angles_once = angles;
    ends_.q1 = ends_.q0;
    ends_.v1 = ends_.v0;
    Vector angles_twice = angles;
    bool solved = slip_start_->take(h, contacts, q_once, v_once, angles_once) &&
                  slip_start_->take(0.5 * h, contacts, ends_.q1, ends_.v1, angles_twice);
    const Vector first_angles = slip_start_->first_angles();
    solved = solved && slip_start_->take(0.5 * h, contacts, ends_.q1, ends_.v1, angles_twice);
    double error = std::numeric_limits<double>::infinity();
    if (solved) {
      error = 0;
      for (Eigen::Index c = 0; c < info_.n_q; ++c) {
        error = std::max({error, std::abs(q_once[c] - ends_.q1[c]) / (1 + std::abs(ends_.q0[c])),
                          std::abs(v_once[c] - ends_.v1[c]) / (1 + std::abs(ends_.v0[c]))});
      }
      error /= tolerance_;
    }
    bool accepted = error <= 1;
    if (accepted) {
      // The polynomial between the ends, and whether another contact changes its mode there.
      ends_.h = h;
      ends_.collocation = nullptr;
      slip_start_->hold(contacts, first_angles);
      if (!accelerate()) return false;
      slip_start_->hold(contacts, angles_twice);
      if (!dynamics_.accelerate(ends_.q1.data(), ends_.v1.data(), ends_.a1.data())) return stop_undetermined();
      const DetectedEvent event = functions_.find(ends_, contacts);
      const bool is_at_once = event.theta * h < kShortestStart * T_ && h < 10 * kShortestStart * T_;
      accepted = !event || is_at_once || event.theta > 1 - 1e-9;
      if (!accepted && t_ + h > t_ && event.theta > 0.1)
        h *= std::min(0.9, 0.99 * event.theta);
      else if (!accepted)
        h *= 0.1;
      if (!accepted && has_started(contacts)) return finish();
      if (!accepted) continue;
    }
    if (!accepted) {
      h *= std::isfinite(error) ? std::clamp(0.8 * std::pow(error, -1.0 / 7), 0.1, 0.8) : 0.25;
      continue;
    }
    if (leaves_region(h)) {
      finish();
      return false;
    }
    record_motion(t_ + h);
    if (!sample_start(h, angles, contacts)) return false;
    t_ = is_last ? T_ : t_ + h;
    ends_.advance();
    angles = angles_twice;
    functions_.advance(ends_.v0);
    if (is_last || slip_start_->stiffness(h, contacts, ends_.q0, ends_.v0, angles) < kExplicit) return finish();
    h *= std::clamp(0.8 * std::pow(error + 1e-30, -1.0 / 7), 0.5, 4.0);
  }
  return finish();
}

/// Whether all of these contacts slip already.
bool EventDrivenRun::has_started(const std::vector<int>& contacts) {
  return std::ranges::all_of(contacts, [&](int i) {
    double v_t[2];
    functions_.slip_velocity(i, ends_.q0.data(), ends_.v0.data(), v_t);
    return std::hypot(v_t[0], v_t[1]) > scales_.no_slip(i);
  });
}

/// Dense samples within a step of SlipStart.
bool EventDrivenRun::sample_start(double h, const Vector& angles, const std::vector<int>& contacts) {
  const auto reach = [&](double until) {
    Vector at = angles;
    ends_.q1 = ends_.q0;
    ends_.v1 = ends_.v0;
    return slip_start_->take(until, contacts, ends_.q1, ends_.v1, at);
  };
  return sample_until(t_ + h, reach);
}

/// Directions of slip as they are in the middle of a step of length h [s]. False where the iteration does not converge.
bool EventDrivenRun::hold_middle_directions(const std::vector<int>& contacts, double h) {
  bool converged = false;
  for (int sweep = 0; sweep < kMaxTurns && !converged; ++sweep) {
    converged = true;
    for (const int i : contacts) {
      double angle = 0, last_angle = 0, last_across = 0;
      for (int k = 0; k < kMaxTurns; ++k) {
        double d[2], v_t[2];
        dynamics_.direction(i, d);
        if (k == 0) angle = std::atan2(d[1], d[0]);
        if (!step_.take(0.5 * h, nullptr)) break;
        functions_.slip_velocity(i, ends_.q1.data(), ends_.v1.data(), v_t);
        // Nearly linear in the angle of d, which the angle between d and v_t is not where v_t is tiny.
        const double across = (d[0] * v_t[1] - d[1] * v_t[0]) / std::hypot(v_t[0], v_t[1]);
        const double speed = d[0] * v_t[1] - d[1] * v_t[0];
        const double turn = k == 0                 ? std::clamp(across, -1e-3, 1e-3)
                            : speed == last_across ? 0
                                                   : -speed * (angle - last_angle) / (speed - last_across);
        if (k == 0 && std::abs(across) < 1e-9) break;
        converged = false;
        last_angle = angle;
        last_across = speed;
        angle += std::clamp(turn, -0.5, 0.5);
        const double turned[2]{std::cos(angle), std::sin(angle)};
        dynamics_.hold_direction(i, turned);
        if (k > 0 && std::abs(turn) < 1e-15) break;
      }
    }
  }
  return converged;
}

/// start_slip() with derivatives, which explicit steps alone have: with the direction that slip has in the middle of a short
/// step, held over the whole of it, the error is of third order in the velocity.
bool EventDrivenRun::start_slip_at_held_directions() {
  return hold_directions(mode_change_.beginning(), std::min(kHeldStart * std::cbrt(tolerance_) * T_, T_ - t_), true);
}

/// Time [s] within which the direction of friction does not matter: it changes slip velocities by 2 mu lambda_n G_tt each,
/// together by less than the tolerance.
double EventDrivenRun::harmless_length(const std::vector<int>& contacts) const {
  double change = 0;  // [m/s^2]
  for (const int i : contacts)
    change += 2 * info_.contacts[i].mu * dynamics_.normal_force(i) * scales_.tangential_delassus(i);
  return kOfTolerance * tolerance_ / change;
}

/// A step of at most h [s] with directions held. @param in_middle  those in the middle of the step, which are looked for
bool EventDrivenRun::hold_directions(const std::vector<int>& contacts, double h, bool in_middle) {
  if (!accelerate()) return false;
  functions_.begin(ends_.q0.data(), ends_.v0.data());
  for (bool is_free = false; !is_free;) {  // no other contact changes its mode
    if ((in_middle && !hold_middle_directions(contacts, h)) || !step_.take(h, nullptr) || !step_.finish())
      return stop(Status::inner_solver_failed, fmt::format("no motion follows the begin of slip at contact '{}'",
                                                           info_.contacts[contacts.front()].name));
    const DetectedEvent event = functions_.find(ends_, contacts);
    is_free = !event || event.theta > 1 - 1e-9 || h < 10 * kShortestStart * T_;
    if (!is_free) h *= std::clamp(0.9 * event.theta, 0.1, 0.9);
  }
  if (leaves_region(h)) {
    for (const int i : contacts) dynamics_.hold_direction(i, nullptr);
    return false;
  }
  if (sensitivity_ && !sensitivity_->take_slip_start(ends_, h, contacts)) return stop_undetermined();
  if (!in_middle) record_motion(t_ + h);
  if (!sample_until(t_ + h)) return false;
  ends_.q0 = ends_.q1;
  ends_.v0 = ends_.v1;
  for (const int i : contacts) dynamics_.hold_direction(i, nullptr);
  t_ += h;
  h_ = std::min(h_, h);
  ++counters_.steps;
  return true;
}

/// Dense samples up to a time, whose states lie `reach(h)` from the left end of the step at hand; its right end is kept.
bool EventDrivenRun::sample_until(double end, const auto& reach) {
  const auto time = [&] { return T_ * next_sample_ / n_samples_; };
  if (next_sample_ > n_samples_ || time() > end) return true;
  const Vector q1 = ends_.q1, v1 = ends_.v1, a1 = ends_.a1;
  for (; next_sample_ <= n_samples_ && time() <= end; ++next_sample_) {
    if (!reach(time() - t_)) return stop_undetermined();
    solution_.samples.push_back({time(), ends_.q1, ends_.v1, ends_.v1});
  }
  ends_.q1 = q1;
  ends_.v1 = v1;
  ends_.a1 = a1;
  return true;
}

bool EventDrivenRun::sample_until(double end) {
  return sample_until(end, [&](double h) { return step_.take(h, nullptr); });
}

/// The interpolation of the step at hand, which ends at a time [s].
void EventDrivenRun::record_motion(double end) {
  bound_motion();
  if (settings_.recording != Recording::motion) return;
  solution_.motion.add(t_, end, ends_.degree(), [&](double s, Vector& q, Vector& v) {
    q.resize(info_.n_q);
    v.resize(info_.n_q);
    ends_.interpolate(s, q, v);
  });
}

/// Extends Settings::reached by the step at hand.
void EventDrivenRun::bound_motion() {
  if (settings_.reached == nullptr) return;
  path_.resize(info_.n_q, ends_.degree() + 1);
  path_error_.resize(info_.n_q);
  ends_.bernstein(path_, path_error_);
  bernstein::extend(path_, ends_.degree(), *settings_.reached);
}

void EventDrivenRun::record(const DetectedEvent& cause, const Vector& v_minus) {
  const auto& modes = dynamics_.modes();
  const Vector& Lambda_n = mode_change_.Lambda_n();
  for (const int i : info_.unilateral) {
    const auto kind = event_kind(before_[i], modes[i], Lambda_n[i] > 0, cause.is(SwitchKind::slip_stops, i));
    if (!kind) continue;
    ++counters_.events;
    if (settings_.recording == Recording::final_state) continue;
    solution_.events.push_back({t_, *kind, i, ends_.q0, v_minus, ends_.v0, Lambda_n, mode_change_.Lambda_t(), modes,
                                sensitivity_ ? sensitivity_->dt() : Vector()});
  }
  if (settings_.recording >= Recording::grid) solution_.samples.push_back({t_, ends_.q0, v_minus, ends_.v0});
}

}  // namespace ricochet
