#include "reference/event_located.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "problems/regions/static_friction.h"
#include "reference/bracketed_root.h"
#include "reference/contact_dynamics.h"
#include "reference/contact_laws.h"
#include "reference/flights.h"
#include "reference/mode_changes.h"
#include "reference/regions.h"
#include "reference/slips.h"
#include "reference/smooth_motion.h"
#include "reference/step_watch.h"
#include "reference/stop.h"

namespace ricochet::reference {
namespace {

// Ensures that runs end: this number of steps must advance the time by this fraction of end_time.
constexpr long kStepsPerMark = 20'000;
constexpr double kLeastProgress = 1e-6;

// Deepest gap of a group, by the heights of resting_groups.h (1): ten are the offset of flights.h (2).
constexpr double kSunk = 12;

// Roots one after the other that are no events: the rounding of a gap that is zero and opens. A new start ends them.
constexpr int kPassedRoots = 20;

/// Integrates from event to event, until the end, a limit, or a missed root.
class EventLocatedRun {
 public:
  EventLocatedRun(const Problem& problem, const EventLocatedSettings& settings)
      : problem_(problem),
        settings_(settings),
        scales_(problem),
        dynamics_(problem),
        slips_(problem, scales_, dynamics_, settings.tolerance),
        flights_(problem, scales_, settings.tolerance, settings.zeno_interval * problem.info().end_time,
                 settings.in_flight),
        motion_(problem, scales_, settings, dynamics_, slips_, flights_),
        watch_(problem, scales_, settings.tolerance, dynamics_, slips_, flights_, motion_),
        mode_changes_(problem, scales_, settings.tolerance, dynamics_, slips_, flights_, motion_),
        begin_(Clock::now()) {}

  Solution run();
  std::vector<char> in_flight() const { return flights_.in_flight(); }

 private:
  using Clock = std::chrono::steady_clock;

  bool check_gaps(double t, Solution& solution);
  bool check_friction(double t, const Roots& found, Solution& solution);
  bool check_limits(double t, Solution& solution);
  std::string holding_up(const Solution& solution) const;
  void record(double from, double t, Solution& solution);
  void go_to_border(double from, double& t, int k, Solution& solution);
  void restart(double t, Solution& solution);
  double longest_step(double t, const Solution& solution);
  const std::string& name(int i) const { return problem_.info().contacts[i].name; }

  const Problem& problem_;
  const EventLocatedSettings& settings_;
  const Scales scales_;
  ContactDynamics dynamics_;
  Slips slips_;
  Flights flights_;
  SmoothMotion motion_;
  StepWatch watch_;
  ModeChanges mode_changes_;
  const Clock::time_point begin_;
  double mark_ = 0;                 // time where progress was measured last [s]
  long next_mark_ = kStepsPerMark;  // number of steps at which it is measured again
};

/// Detects a missed root by its penetration.
bool EventLocatedRun::check_gaps(double t, Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector gap = problem_.gap(solution.q);
  const Vector gap_size = scales_.gap(J, solution.q);
  const Vector size = gap_size + problem_.info().end_time * scales_.speed(J, solution.v);
  const double part = std::max(kSame, 100 * settings_.tolerance);  // more than closed contacts drift
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (problem_.info().contacts[i].is_bilateral && std::abs(gap[i]) > part * size[i])
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("bilateral constraint '{}' has drifted to {:.3g} m", name(i), gap[i]));
    if (gap[i] < -part * size[i] && flights_.bounced(i, t))  // too low for its next impact to be seen
      return flights_.stop_accumulation(t, solution);
    if (is_closed(dynamics_.modes()[i]) && gap[i] > part * size[i])
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("closed contact '{}' has left its surface, its gap is {:.3g} m", name(i), gap[i]));
    if (gap[i] < -part * size[i])
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("contact '{}' was passed unnoticed, its gap is {:.3g} m", name(i), gap[i]));
    const double deepest = kSunk * std::max(settings_.tolerance, kTouching) * gap_size[i];
    if (mode_changes_.has_groups() && gap[i] < -deepest)
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("contact '{}' of a group has sunk by {:.3g} m, more than {:.3g} m", name(i), -gap[i], deepest),
          {FailureCode::impacts_accumulate, {name(i)}});
  }
  return true;
}

/// Detects a missed root (2) or (3) of smooth_motion.h, and forces that grow without bound.
bool EventLocatedRun::check_friction(double t, const Roots& found, Solution& solution) {
  if (dynamics_.closed().empty()) return true;
  if (!motion_.accelerate(solution.q, solution.v))
    return stop(solution, Status::inner_solver_failed, t,
                "the contact forces do not determine the motion, (5) is singular");
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  const double part = std::max(kSame, 100 * settings_.tolerance);  // as for gaps
  motion_.note_forces();
  for (const int i : dynamics_.closed()) {
    if (!slips_.has_friction(i) || found.normal[i] || found.friction[i]) continue;
    double value = 0;
    if (dynamics_.modes()[i] == ContactMode::stick)
      value = motion_.cone_slack(i) / motion_.force_size(i);
    else if (!slips_.is_new(i))  // a new slip has its own root below zero
      value = slips_.direction(i).dot(slips_.velocity(i, J_t, solution.v)) / slips_.size(i, J_t, solution.v);
    if (std::min(value, motion_.normal_force(i) / motion_.force_size(i)) < -part) {
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("the end of mode {} of contact '{}' was passed unnoticed",
                              to_string(dynamics_.modes()[i]), name(i)));
    }
  }
  return true;
}

/// The contacts that prevent progress: those of the last events, or slipping, or closed ones.
std::string EventLocatedRun::holding_up(const Solution& solution) const {
  std::vector<char> held(problem_.info().contacts.size(), false);
  for (const Event& event : solution.events) {
    if (event.t > mark_) held[event.contact] = true;
  }
  const auto& modes = dynamics_.modes();
  const bool any_slips = std::ranges::any_of(modes, is_slipping);
  if (std::ranges::count(held, true) == 0) {
    for (const int i : dynamics_.closed()) held[i] = !any_slips || is_slipping(modes[i]);
  }
  std::vector<std::string> names;
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (held[i]) names.push_back(fmt::format("'{}' ({})", name(i), to_string(modes[i])));
  }
  if (names.empty()) return "the smooth motion";
  return fmt::format("contact{} {}", names.size() > 1 ? "s" : "", fmt::join(names, ", "));
}

bool EventLocatedRun::check_limits(double t, Solution& solution) {
  const long steps = solution.counters.steps + motion_.integrator().work().steps;
  if (steps >= next_mark_) {
    if (t - mark_ < kLeastProgress * problem_.info().end_time)
      return stop(solution, Status::step_limit, t,
                  fmt::format("{} steps of {} move the time by {:.3g} s: the time is held up by {}", kStepsPerMark,
                              motion_.integrator().name(), t - mark_, holding_up(solution)));
    mark_ = t;
    next_mark_ = steps + kStepsPerMark;
  }
  if (settings_.time_limit > 0 && std::chrono::duration<double>(Clock::now() - begin_).count() > settings_.time_limit)
    return stop(solution, Status::time_limit, t,
                fmt::format("the time limit of {:.6g} s is over", settings_.time_limit));
  if (steps >= settings_.max_steps)
    return stop(solution, Status::step_limit, t,
                fmt::format("{} steps of {}", settings_.max_steps, motion_.integrator().name()));
  if (std::ssize(solution.events) >= settings_.max_events)
    return stop(solution, Status::step_limit, t, fmt::format("{} events", settings_.max_events));
  return true;
}

/// Records the last step up to t.
void EventLocatedRun::record(double from, double t, Solution& solution) {
  constexpr int kHighestDegree = 12;  // of Adams' formulas; those of other integrators are lower
  if (!settings_.records_motion) return;
  solution.motion.add(from, t, kHighestDegree,
                      [&](double s, Vector& q, Vector& v) { motion_.load(s < 1 ? from + s * (t - from) : t, q, v); });
}

/// Goes from the root with the offset delta_k (regions.h (1)), at t, back to the zero of psi_k. It lies in the last step, or
/// before it by a time d, for which
///
///     q + v d + a d^2 / 2,   v + a d                                                                         (2)
///
/// is accurate if d^2 is below the tolerance. If d is longer, both sides of the border have the same motion.
void EventLocatedRun::go_to_border(double from, double& t, int k, Solution& solution) {
  Vector q, v;
  const auto in_step = [&](double time) {
    motion_.load(time, q, v);
    return motion_.inside(k, q, v);
  };
  if (in_step(t) > 0) return;  // the limit, regions.h (2)
  if (in_step(from) > 0) {
    solution.t = t = bracketed_root(in_step, from, t);
    motion_.load(t, solution.q, solution.v);
    return;
  }
  if (!motion_.accelerate(solution.q, solution.v)) return;
  const auto shifted = [&](double d) {
    q = solution.q + d * solution.v + 0.5 * d * d * motion_.acceleration();
    v = solution.v + d * motion_.acceleration();
    return motion_.inside(k, q, v);
  };
  const double longest = std::sqrt(settings_.tolerance) * problem_.info().end_time;
  if (!(shifted(-longest) > 0)) return;
  const double d = bracketed_root(shifted, -longest, 0);
  shifted(d);
  solution.t = t = std::max(0.0, t + d);
  solution.q = q;
  solution.v = v;
}

void EventLocatedRun::restart(double t, Solution& solution) {
  motion_.count(solution.counters);
  motion_.restart(t, solution.q, solution.v);
  watch_.restart();
}

/// Longest next step [s]; 0: no limit.
double EventLocatedRun::longest_step(double t, const Solution& solution) {
  const double flight = flights_.longest_step(t);
  const double watched = watch_.longest_step(t, motion_.integrator().planned_step(), solution.q, solution.v);
  return flight > 0 && watched > 0 ? std::min(flight, watched) : std::max(flight, watched);
}

Solution EventLocatedRun::run() {
  Solution solution;
  solution.q = problem_.info().q0;
  solution.v = problem_.info().v0;
  const double T = problem_.info().end_time;
  double t = 0;
  if (mode_changes_.decide(t, motion_.no_roots(), solution)) {
    solution.initial_modes = dynamics_.modes();
    restart(t, solution);
    int passed_roots = 0;      // one after the other
    bool passed_root = false;  // that SmoothMotion::roots() does not take for one
    solution.exit.function = motion_.border_passed(solution.q, solution.v);
    const auto ends = [&] { return settings_.ends && settings_.ends(solution, dynamics_.modes()); };
    while (t < T && solution.exit.function < 0 && !ends() && check_limits(t, solution)) {
      const double from = t;
      const StepEnd end = motion_.step(t, longest_step(t, solution));
      if (end == StepEnd::stuck_at_root && passed_root) {  // a gap that opens again
        passed_root = false;
        restart(t, solution);
        continue;
      }
      motion_.load(solution.q, solution.v);
      solution.t = t;
      if (end == StepEnd::stuck_at_root || end == StepEnd::failed) {
        stop(solution, Status::inner_solver_failed, t,
             fmt::format("{} ended with {}", motion_.integrator().name(), motion_.integrator().failure()));
        break;
      }
      Roots found = motion_.roots_at_end(end, solution.q, solution.v);
      solution.exit.function = motion_.border_at_end(end);
      if (const auto root = watch_.first_root(from, t, found)) {
        solution.exit.function = -1;
        solution.t = t = *root;
        motion_.load(t, solution.q, solution.v);
      }
      if (solution.exit.function >= 0) go_to_border(from, t, solution.exit.function, solution);
      record(from, t, solution);
      if (!check_gaps(t, solution)) break;
      if (problem_.info().has_friction() && !check_friction(t, found, solution)) break;
      if (solution.exit.function >= 0) break;
      if (found.any()) {
        if (!mode_changes_.decide(t, found, solution)) break;
        solution.t = t;
        solution.exit.function = motion_.border_passed(solution.q, solution.v);
        restart(t, solution);
        passed_root = false;
      } else {
        slips_.follow(solution.q, solution.v);
        flights_.follow(solution.q);
        passed_root = end == StepEnd::root;
        passed_roots = passed_root ? passed_roots + 1 : 0;
        if (passed_roots == kPassedRoots) {
          restart(t, solution);
          passed_root = false;
          passed_roots = 0;
        }
      }
    }
  }
  const bool goes_on = !problem_.info().region.empty();  // in another region, where drift would be a flight
  if (solution.succeeded() && (problem_.info().has_bilateral() || goes_on)) {
    std::vector<char> rests(dynamics_.modes().size(), false);
    for (const int i : dynamics_.closed()) rests[i] = dynamics_.modes()[i] == ContactMode::stick;
    ContactLaws(problem_, scales_).project(solution.q, solution.v, dynamics_.closed(), dynamics_.closed(), rests);
  }
  motion_.count(solution.counters);
  solution.counters.events = static_cast<std::int64_t>(solution.events.size());
  return solution;
}

}  // namespace

RegionPiece integrate_in_region(const Problem& problem, const EventLocatedSettings& settings) {
  EventLocatedRun run(problem, settings);
  Solution solution = run.run();
  return {std::move(solution), run.in_flight()};
}

Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings) {
  if (problem.info().has_static_friction()) {
    StaticFrictionRun run(problem, [&](const Problem& here, const auto&, int, const EndsRun& ends) {
      EventLocatedSettings of_piece = settings;
      of_piece.ends = ends;
      return integrate_event_located(here, of_piece);
    });
    return run.solve(0);
  }
  Solution solution = problem.info().switches.empty() ? integrate_in_region(problem, settings).solution
                                                      : integrate_by_regions(problem, settings);
  fail_where_bound_is_negative(problem, 0, solution);
  return solution;
}

}  // namespace ricochet::reference
