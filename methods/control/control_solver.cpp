#include "methods/control/control_solver.h"

#include <utility>

#include "methods/control/shooting/refinement.h"

namespace ricochet {

HomotopyControlSolver::HomotopyControlSolver(Transcription& transcription, const HomotopyOptions& options,
                                             MpccSolver::Progress progress)
    : transcription_(transcription), solver_(transcription.mpcc(), options), progress_(std::move(progress)) {}

ControlSolution HomotopyControlSolver::solve() {
  last_ = solver_.solve(progress_);
  return take();
}

ControlSolution HomotopyControlSolver::resolve(int k, const Vector& q, const Vector& v,
                                               const std::vector<bool>& is_closed) {
  transcription_.start_at(k, plan_, q, v, is_closed);
  last_ = solver_.resolve(progress_);
  return take();
}

ControlSolution HomotopyControlSolver::take() {
  ControlSolution solution;
  solution.status = last_.status;
  solution.message = last_.message;
  solution.complementarity = last_.complementarity;
  solution.violation = last_.violation.value;
  solution.violated = last_.violation.name;
  solution.is_b_stationary = last_.is_b_stationary;
  solution.kept_branch = last_.kept_branch;
  solution.steps = last_.steps;
  solution.iterations = last_.iterations;
  int iterations = 0;
  for (const HomotopyStep& step : last_.steps)
    solution.progress.push_back({iterations += step.iterations, step.objective, step.violation});
  solution.seconds = last_.seconds;
  solution.derivative_seconds = last_.derivative_seconds;
  if (!last_.succeeded()) return solution;
  plan_ = last_.x;
  solution.trajectory = transcription_.trajectory(plan_);
  solution.stationarity = transcription_.stationarity(last_);
  return solution;
}

ShootingControlSolver::ShootingControlSolver(const OptimalControlProblem& problem, const ButcherTableau& tableau,
                                             const ShootingOptions& options, Start start, Shooting::Progress progress)
    : problem_(problem),
      tableau_(tableau),
      options_(options),
      start_(std::move(start)),
      progress_(std::move(progress)),
      shooting_(problem, tableau, options) {}

ControlSolution ShootingControlSolver::solve() {
  shooting_.set_time_limit(options_.time_limit);
  std::vector<ControlIterate> progress;
  ControlSolution solution =
      solve_refined(shooting_, start_.guesses, start_.refine, start_.T > 0 ? start_.T : problem_.plant->info().end_time,
                    [&](const ShootingIteration& iteration) {
                      progress.push_back({iteration.number - 1, iteration.cost, iteration.violation});
                      if (progress_) progress_(iteration);
                    });
  progress.push_back({solution.iterations, solution.trajectory.objective, solution.violation});
  solution.progress = std::move(progress);
  plan_ = solution.trajectory;
  first_ = 0;
  return solution;
}

ControlSolution ShootingControlSolver::resolve(int k, const Vector& q, const Vector& v, const std::vector<bool>&) {
  shooting_.set_time_limit(start_.warm_time_limit);
  ControlSolution solution = shooting_.resolve(k - first_, q, v, progress_);
  if (!solution.has_plan()) return solution;
  first_ = k;
  ControlTrajectory& rest = solution.trajectory;
  const Eigen::Index n = rest.u.cols(), N = n + k;
  const double start = k * rest.T / static_cast<double>(n);
  for (auto& point : rest.points) point.t += start;
  for (auto& impulse : rest.impulses) impulse.t += start;
  plan_.u.rightCols(n) = rest.u;
  plan_.interval_cost.tail(n) = rest.interval_cost;
  rest.objective += plan_.interval_cost.head(k).sum();
  rest.u = plan_.u;
  rest.interval_cost = plan_.interval_cost;
  rest.T *= static_cast<double>(N) / static_cast<double>(n);
  return solution;
}

Transcription::Simulation ShootingControlSolver::simulation() const {
  return {tableau_, {.n_fe = problem_.n_fe, .as_needed = true, .equal_runs = true}};
}

int ShootingControlSolver::n_variables() const {
  return problem_.plant->info().n_u * problem_.n_intervals + (problem_.is_time_free ? 1 : 0);
}

}  // namespace ricochet
