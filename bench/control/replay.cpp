#include "bench/control/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/measure/penetration.h"
#include "methods/registry.h"
#include "problems/control/replay_problem.h"
#include "reference/event_located.h"

namespace ricochet {
namespace {

// Smallest impulse of an impact, relative to the largest momentum.
constexpr double kImpact = 1e-6;

}  // namespace

Replay replay(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, const IntervalSolver& solve) {
  ReplayProblem plant(problem);
  const Eigen::Index n = trajectory.u.cols();
  const double H = trajectory.T / static_cast<double>(n);
  Replay result;
  result.q = problem.plant->info().q0;
  result.v = problem.plant->info().v0;
  result.points.push_back({0, result.q, result.v});
  for (Eigen::Index k = 0; k < n; ++k) {
    plant.restart(result.q, result.v, trajectory.u.col(k), H);
    const Solution s = solve(plant);
    const double start = static_cast<double>(k) * H;
    for (Event event : s.events) {
      event.t += start;
      result.events.push_back(std::move(event));
    }
    result.penetration = std::max(result.penetration, penetration(plant, s.motion));
    result.q = plant.of_plant(s.q);
    result.v = plant.of_plant(s.v);
    result.points.push_back({start + s.t, result.q, result.v});
    result.cost += plant.cost(s.v);
    if (!s.succeeded()) {
      result.status = s.status;
      result.message = fmt::format("interval {} of {}, from t = {:.6g} s: {}", k + 1, n, start, s.message);
      return result;
    }
  }
  result.cost += problem.terminal_cost.at(result.q, result.v)[0];
  return result;
}

IntervalSolver reference_solver(double tolerance) {
  return [tolerance](const Problem& plant) {
    return reference::integrate_event_located(plant,
                                              {.tolerance = tolerance, .time_limit = 60, .records_motion = true});
  };
}

IntervalSolver pivoting_solver(double tolerance) {
  return [tolerance](const Problem& plant) {
    Settings settings;
    settings.tolerance = tolerance;
    settings.time_limit = 60;
    settings.recording = Recording::motion;
    return make_method("fesd_adaptive:radau-iia:4")->solve(plant, settings);
  };
}

double smallest_impact(const OptimalControlProblem& problem, const ControlTrajectory& trajectory) {
  double momentum = 0;
  for (const auto& point : trajectory.points)
    momentum = std::max(momentum, (problem.plant->mass_matrix(point.q) * point.v).cwiseAbs().maxCoeff());
  return kImpact * momentum;
}

ReplayMismatch mismatch(const OptimalControlProblem& problem, const ControlTrajectory& claimed, const Replay& truth) {
  ReplayMismatch result;
  const auto& end = claimed.points.back();
  result.terminal = std::max((end.q - truth.q).cwiseAbs().maxCoeff(), (end.v - truth.v).cwiseAbs().maxCoeff());
  result.cost = truth.cost - claimed.objective;

  const double least = smallest_impact(problem, claimed);
  std::vector<std::pair<int, double>> expected, found;
  for (const auto& impulse : claimed.impulses) {
    if (impulse.Lambda_n > least) expected.emplace_back(impulse.contact, impulse.t);
  }
  for (const auto& event : truth.events) {
    if (event.kind == EventKind::impact && event.Lambda_n[event.contact] > least)
      found.emplace_back(event.contact, event.t);
  }
  std::ranges::sort(expected);  // impacts at the same instant have no order
  std::ranges::sort(found);
  const bool same = std::equal(expected.begin(), expected.end(), found.begin(), found.end(),
                               [](const auto& a, const auto& b) { return a.first == b.first; });
  if (!same) result.events = INFINITY;
  for (std::size_t k = 0; same && k < expected.size(); ++k)
    result.events = std::max(result.events, std::abs(expected[k].second - found[k].second));
  return result;
}

}  // namespace ricochet
