#include "bench/studies/control/gradient.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "methods/registry.h"
#include "problems/control/replay_problem.h"

namespace ricochet {
namespace {

Vector stacked(const Vector& q, const Vector& v) {
  Vector x(q.size() + v.size());
  x << q, v;
  return x;
}

}  // namespace

Matrix gradient_by_differences(const OptimalControlProblem& problem, const ControlTrajectory& trajectory,
                               const IntervalSolver& solve, double change) {
  const auto end = [&](const ControlTrajectory& varied) {
    const Replay result = replay(problem, varied, solve);
    if (result.status != Status::success) throw std::runtime_error("gradient by differences: " + result.message);
    const int n = problem.plant->info().n_mechanical();
    return stacked(result.q.head(n), result.v.head(n));
  };
  const Vector here = end(trajectory);
  Matrix gradient = Matrix::Zero(here.size(), trajectory.u.size());
  ControlTrajectory varied = trajectory;
  for (Eigen::Index column = 0; column < trajectory.u.size(); ++column) {
    const double u = trajectory.u.reshaped()[column], delta = change * std::max(std::abs(u), 1.0);
    for (const auto& [place, weight] : {std::pair{1, 8}, {-1, -8}, {2, -1}, {-2, 1}}) {
      varied.u.reshaped()[column] = u + place * delta;
      gradient.col(column) += weight / (12 * delta) * (end(varied) - here);
    }
    varied.u.reshaped()[column] = u;
  }
  return gradient;
}

Matrix gradient_by_sensitivities(const OptimalControlProblem& problem, const ControlTrajectory& trajectory,
                                 const std::string& method_name, int steps) {
  const auto method = make_method(method_name);
  ReplayProblem plant(problem);
  const Eigen::Index n_q = problem.plant->info().n_mechanical(), n_u = trajectory.u.rows(), n = trajectory.u.cols();
  Settings settings;
  settings.steps = steps;
  for (const char* kind : {"q0", "v0"}) {
    for (int k = 0; k < n_q; ++k) settings.sensitivities.push_back(fmt::format("{}:{}", kind, k));
  }
  for (int c = 0; c < n_u; ++c) settings.sensitivities.push_back("param:" + ReplayProblem::control_parameter(c));

  Vector q = problem.plant->info().q0, v = problem.plant->info().v0;
  Matrix gradient = Matrix::Zero(2 * n_q, n_u * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    plant.restart(q, v, trajectory.u.col(k), trajectory.T / static_cast<double>(n));
    const Solution s = method->solve(plant, settings);
    if (!s.succeeded()) throw std::runtime_error(fmt::format("gradient, interval {}: {}", k + 1, s.message));
    Matrix change(2 * n_q, 2 * n_q + n_u);
    change << s.dq.topRows(n_q), s.dv.topRows(n_q);
    gradient.leftCols(n_u * k) = (change.leftCols(2 * n_q) * gradient.leftCols(n_u * k)).eval();  // (1)
    gradient.middleCols(n_u * k, n_u) = change.rightCols(n_u);
    q = plant.of_plant(s.q);
    v = plant.of_plant(s.v);
  }
  return gradient;
}

IntervalSolver fixed_step_solver(const std::string& method, int steps) {
  return [method, steps](const Problem& plant) {
    Settings settings;
    settings.steps = steps;
    return make_method(method)->solve(plant, settings);
  };
}

}  // namespace ricochet
