#include "bench/control/control_claim.h"

#include <algorithm>
#include <cmath>

#include "bench/control/replay.h"

namespace ricochet {
namespace {

std::vector<double> list(const Vector& x) {
  return {x.begin(), x.end()};
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

}  // namespace ricochet
