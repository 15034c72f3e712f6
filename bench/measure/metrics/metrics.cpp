#include "bench/measure/metrics/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "bench/measure/metrics/law_residuals.h"
#include "bench/measure/metrics/momentum.h"
#include "bench/measure/metrics/motion_integral.h"
#include "bench/measure/penetration.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

// The reference motion is needed to fewer digits than its end; a motion that is another one is further away.
constexpr double kMotionTolerance = 1e-13, kSameMotion = 1e-7;
constexpr double kMotionLimit = 60;      // wall time [s]
constexpr double kAwayFromJumps = 0.01;  // of the time

double largest(const Vector& x) {
  return x.size() == 0 ? 0 : x.lpNorm<Eigen::Infinity>();
}

void compare_motions(const Problem& problem, const Motion& motion, const Solution& reference, Metrics& metrics) {
  const int n = problem.info().n_mechanical();
  const Motion& truth = reference.motion;
  Vector q, v, true_q, true_v;
  metrics.position_error = metrics.velocity_error = 0;
  const auto compare = [&](std::size_t piece, double t) {
    const double begin = motion.begin_of(piece), end = motion.end_of(piece);
    motion.within(piece, std::clamp((t - begin) / (end - begin), 0.0, 1.0), q, v);
    truth.at(std::clamp(t, truth.begin(), truth.end()), true_q, true_v);
    raise_to(metrics.position_error, largest((q - true_q).head(n)));
    return largest((v - true_v).head(n));
  };
  for (std::size_t piece = 0; piece < motion.n_pieces(); ++piece) {
    const auto is_jump = [](const Event& event) { return event.kind == EventKind::impact; };
    const std::vector<double> cuts = cuts_of(motion, piece, reference.events, is_jump);
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const double h = cuts[k + 1] - cuts[k];
      compare(piece, cuts[k + 1]);
      for (const auto& [place, weight] : kGauss)
        metrics.velocity_error += h * weight * compare(piece, cuts[k] + place * h);
    }
  }
}

/// Adds the metrics of a method that returns only the ends of its steps, as engines do.
void compare_samples(const Problem& problem, const Solution& solution, const Motion& truth, Metrics& metrics) {
  const int n = problem.info().n_mechanical();
  Vector q, v;
  for (const Sample& sample : solution.samples) {
    truth.at(std::clamp(sample.t, truth.begin(), truth.end()), q, v);
    raise_to(metrics.position_error, largest((sample.q - q).head(n)));
  }
}

/// At the end, where neither has an impact shortly before.
void compare_ends(const Problem& problem, const Solution& solution, const Solution& reference, Metrics& metrics) {
  for (const Solution* s : {&solution, &reference}) {
    for (const Event& event : s->events) {
      if (event.kind == EventKind::impact && event.t > (1 - kAwayFromJumps) * solution.t) return;
    }
  }
  const int n = problem.info().n_mechanical();
  metrics.end_velocity_error = largest((solution.v - reference.v).head(n));
  if (problem.info().structure.has_potential)
    metrics.energy_error = *problem.energy(solution.q, solution.v) - *problem.energy(reference.q, reference.v);
  if (!problem.info().geometry) return;
  const Momentum has = momentum(problem, solution.q, solution.v), should = momentum(problem, reference.q, reference.v);
  metrics.momentum_error = (has.linear - should.linear).norm();
  metrics.angular_momentum_error = (has.angular - should.angular).norm();
}

using EventGroup = std::vector<const Event*>;  // of one contact and kind, in the order of time

std::map<std::pair<int, EventKind>, EventGroup> groups_of(const Solution& solution) {
  std::map<std::pair<int, EventKind>, EventGroup> groups;
  for (const Event& event : solution.events) groups[{event.contact, event.kind}].push_back(&event);
  for (auto& [key, group] : groups) std::ranges::stable_sort(group, {}, [](const Event* event) { return event->t; });
  return groups;
}

/// Index of the event nearest to t, the first of several. @param events  in the order of time
std::size_t nearest(const EventGroup& events, double t) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < events.size(); ++k) {
    if (std::abs(events[k]->t - t) < std::abs(events[best]->t - t)) best = k;
  }
  return best;
}

void compare_events(const Solution& solution, const Solution& reference, Metrics& metrics) {
  const auto own = groups_of(solution), all = groups_of(reference);
  std::size_t pairs = 0;
  for (const auto& [key, truth] : all) {
    const auto found = own.find(key);
    if (found == own.end()) continue;
    const EventGroup& events = found->second;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const std::size_t partner = nearest(events, truth[k]->t);
      if (nearest(truth, events[partner]->t) != k) continue;
      ++pairs;
      raise_to(metrics.event_time_error, std::abs(events[partner]->t - truth[k]->t));
      if (key.second == EventKind::impact && events[partner]->Lambda_n.size() > 0)
        raise_to(metrics.impulse_error, std::abs(events[partner]->Lambda_n[key.first] - truth[k]->Lambda_n[key.first]));
    }
  }
  metrics.missed_events = static_cast<int>(reference.events.size() - pairs);
  metrics.spurious_events = static_cast<int>(solution.events.size() - pairs);
}

}  // namespace

ReferenceMotion reference_motion(const Problem& problem, const reference::Reference& reference) try {
  Solution motion = reference::integrate_event_located(
      problem, {.tolerance = kMotionTolerance, .time_limit = kMotionLimit, .records_motion = true});
  if (!motion.succeeded()) return {{}, "no event-located motion: " + motion.message};
  const double distance =
      reference::final_state_difference(motion.q, motion.v, reference.solution.q, reference.solution.v);
  if (!(distance <= kSameMotion * reference.size()))
    return {{}, fmt::format("the event-located motion ends {:.2g} from the reference", distance)};
  return {std::move(motion), ""};
} catch (const InputError& error) {  // it has contacts that no event-located run can follow
  return {{}, error.what()};
}

Metrics metrics_of_run(const Method& method, const Problem& problem, Settings settings, std::int64_t steps,
                       const ReferenceMotion& reference) {
  Metrics metrics;
  const auto is_too_long = [&metrics](std::int64_t n) {
    if (n > kMostMeasuredSteps) metrics.reason = fmt::format("more than {} steps", kMostMeasuredSteps);
    return n > kMostMeasuredSteps;
  };
  if (is_too_long(steps)) return metrics;
  settings.recording = Recording::motion;
  const Solution solution = method.solve(problem, settings);
  if (!solution.succeeded()) {
    metrics.reason = "the run that records its motion fails: " + solution.message;
  } else if (!is_too_long(solution.counters.steps)) {
    metrics = measure_metrics(problem, solution, reference.get());
    metrics.reason = reference.reason;
  }
  return metrics;
}

Metrics measure_metrics(const Problem& problem, const Solution& solution, const Solution* reference) {
  Metrics metrics;
  metrics.are_known = true;
  if (reference != nullptr) {
    if (!solution.motion.empty())
      compare_motions(problem, solution.motion, *reference, metrics);
    else
      compare_samples(problem, solution, reference->motion, metrics);
    compare_ends(problem, solution, *reference, metrics);
    compare_events(solution, *reference, metrics);
  }
  const ProblemInfo& info = problem.info();
  if (!info.unilateral.empty() && !solution.motion.empty()) metrics.penetration = penetration(problem, solution.motion);
  Vector q, v;
  for (std::size_t piece = 0; info.has_bilateral() && piece < solution.motion.n_pieces(); ++piece) {
    for (const double s : {0.5, 1.0}) {
      solution.motion.within(piece, s, q, v);
      const Vector gap = problem.gap(q);
      for (const int i : info.bilateral) raise_to(metrics.constraint_drift, std::abs(gap[i]));
    }
  }
  measure_impacts(problem, solution, metrics);
  if (reference != nullptr && !solution.motion.empty())
    measure_persistent_contact(problem, solution, *reference, metrics);
  return metrics;
}

}  // namespace ricochet
