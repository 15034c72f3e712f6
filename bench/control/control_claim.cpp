#include "bench/control/control_claim.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bench/control/control_guess.h"
#include "bench/control/replay.h"

namespace ricochet {
namespace {

std::vector<double> list(const Vector& x) {
  return {x.begin(), x.end()};
}

// Tolerance of the event-located reference.
constexpr double kReferenceReplayTolerance = 1e-11;
constexpr double kPivotingTolerance = 1e-9;

void describe_replay(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, ControlRun& run) {
  Replay truth = replay(problem, trajectory, reference_solver(kReferenceReplayTolerance));
  run.replayed_by = "reference";
  run.replay_message = truth.message;
  if (truth.status != Status::success) {
    truth = replay(problem, trajectory, pivoting_solver(kPivotingTolerance));
    run.replayed_by = "pivoting";
  }
  run.replay_status = to_string(truth.status);
  const int n = problem.plant->info().n_mechanical();
  for (const auto& point : truth.points) {
    run.replayed.t.push_back(point.t);
    run.replayed.q.emplace_back(point.q.begin(), point.q.begin() + n);
    run.replayed.v.emplace_back(point.v.begin(), point.v.begin() + n);
  }
  if (truth.status != Status::success) return;
  const ReplayMismatch difference = mismatch(problem, trajectory, truth);
  run.true_cost = truth.cost;
  run.terminal = difference.terminal;
  run.events = std::isfinite(difference.events) ? difference.events : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void describe_claim(const OptimalControlProblem& problem, const ControlSolution& solution, ControlRun& run) {
  const ProblemInfo& info = problem.plant->info();
  const ControlTrajectory& trajectory = solution.trajectory;
  for (const ControlIterate& at : solution.progress) {
    run.progress_iterations.push_back(at.iterations);
    run.progress_cost.push_back(at.cost);
  }
  run.claimed_cost = trajectory.objective;
  run.T = trajectory.T;
  for (const auto& u : trajectory.u.colwise()) run.u.push_back(list(u));
  for (const auto& point : trajectory.points) {
    run.claimed.t.push_back(point.t);
    run.claimed.q.push_back(list(point.q.head(info.n_mechanical())));
    run.claimed.v.push_back(list(point.v.head(info.n_mechanical())));
    if (info.n_c() > 0) run.penetration = std::max(run.penetration, -problem.plant->gap(point.q).minCoeff());
    if (point.lambda_n.size() == 0) continue;
    run.force_t.push_back(point.t);
    run.lambda_n.push_back(list(point.lambda_n));
    run.lambda_t.push_back(list(point.lambda_t));
  }
  const double least = smallest_impact(problem, trajectory);
  for (const auto& impulse : trajectory.impulses) {
    if (impulse.Lambda_n > least)
      run.impacts.push_back({impulse.t, impulse.contact, impulse.Lambda_n, list(impulse.Lambda_t)});
  }
  for (int i = 0; i < info.n_c(); ++i) {
    run.contacts.push_back(info.contacts[i].name);
    run.friction.insert(run.friction.end(), static_cast<std::size_t>(info.contacts[i].n_t), i);
  }
}

ControlRun solve_and_replay(const ControlOptions& options, const std::string& command, bool has_replay) {
  const auto begin = std::chrono::steady_clock::now();
  const auto problem = options.make_problem();
  ControlRun run;
  run.problem = problem->id;
  run.title = problem->title;
  run.method = options.method;
  run.discretisation = options.describe(*problem);
  run.command = command;
  const PreparedMethod method = prepared_method(options, *problem);
  const ControlSolution solution = method.solver->solve();
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.variables = method.solver->n_variables();
  run.pairs = method.solver->n_pairs();
  run.status = to_string(solution.status);
  run.message = solution.message;
  run.iterations = solution.iterations;
  if (!solution.succeeded()) return run;
  run.stationarity = solution.stationarity;
  describe_claim(*problem, solution, run);
  if (has_replay) describe_replay(*problem, solution.trajectory, run);
  return run;
}

}  // namespace ricochet
