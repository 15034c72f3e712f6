#include "methods/control/transcription.h"

#include <fmt/format.h>

#include "methods/control/nlp_blocks.h"
#include "problems/control/replay_problem.h"
#include "problems/join.h"

namespace ricochet {

std::vector<std::vector<int>> Transcription::add_controls() {
  const ProblemInfo& info = problem_.plant->info();
  std::vector<std::vector<int>> u(static_cast<std::size_t>(problem_.n_intervals));
  for (std::size_t k = 0; k < u.size(); ++k) {
    for (int c = 0; c < info.n_u; ++c)
      u[k].push_back(mpcc_.nlp.add_variable(problem_.u.lower[c], problem_.u.upper[c], info.u[c],
                                            fmt::format("interval {}, u[{}]", k + 1, c)));
  }
  return u;
}

int Transcription::add_time() {
  if (!problem_.is_time_free) return -1;
  return mpcc_.nlp.add_variable(problem_.T_lower, problem_.T_upper, problem_.plant->info().end_time, "T");
}

void Transcription::add_path(const std::vector<int>& q, const std::vector<int>& v, const std::vector<int>& u,
                             const std::string& name) {
  if (problem_.path.n_outputs() == 0) return;
  std::vector<int> rows;
  for (const auto& constraint : problem_.path_names)
    rows.push_back(mpcc_.nlp.add_row(0, kInfinity, name + ", " + constraint));
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(problem_.path, join<int>({q, v, u}), rows));
}

void Transcription::add_terminal(const std::vector<int>& q, const std::vector<int>& v) {
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(problem_.terminal_cost, join<int>({q, v}), std::vector<int>{}));
  if (problem_.terminal.n_outputs() == 0) return;
  std::vector<int> rows;
  for (const auto& constraint : problem_.terminal_names) rows.push_back(mpcc_.nlp.add_row(0, 0, "at T, " + constraint));
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(problem_.terminal, join<int>({q, v}), rows));
}

Status Transcription::guess_from_simulation(const Matrix& u) {
  ControlledPlant plant(problem_);
  const ProblemInfo& info = plant.info();
  Counters counters;
  PivotingSolver solver(plant, simulation_.tableau, simulation_.options, counters);
  Vector q = info.q0, v = info.v0;
  solver.start(q, v);
  for (int k = 0; k < problem_.n_intervals; ++k) {
    for (int c = 0; c < info.n_u; ++c) mpcc_.nlp.variables[u_[k][c]].guess = u(c, k);
    plant.set_control(u.col(k));
    const Status status = guess_interval(solver, info.end_time / problem_.n_intervals, k, q, v);
    if (status != Status::success) return status;
  }
  return Status::success;
}

Status Transcription::guess_from_simulation() {
  return guess_from_simulation(problem_.plant->info().u.replicate(1, problem_.n_intervals));
}

Transcription::MeanForces Transcription::mean_forces(const FesdStep& step, const ButcherTableau& tableau) {
  MeanForces mean{Vector::Zero(step.Lambda_n.rows()), Vector::Zero(step.Lambda_t.rows())};
  double H = 0;
  for (int n = 0; n < step.n_elements; ++n) {
    const Stages& element = step.elements[n];
    mean.lambda_n += step.Lambda_n.col(n) + element.h * element.lambda_n * tableau.b;
    mean.lambda_t += step.Lambda_t.col(n) + element.h * element.lambda_t * tableau.b;
    H += element.h;
  }
  mean.lambda_n /= H;
  mean.lambda_t /= H;
  return mean;
}

ControlTrajectory Transcription::read_controls(const Vector& x) const {
  ControlTrajectory trajectory;
  trajectory.u.resize(problem_.plant->info().n_u, problem_.n_intervals);
  for (std::size_t k = 0; k < u_.size(); ++k) {
    for (std::size_t c = 0; c < u_[k].size(); ++c) trajectory.u(c, k) = x[u_[k][c]];
  }
  trajectory.T = T_ >= 0 ? x[T_] : problem_.plant->info().end_time;
  return trajectory;
}

}  // namespace ricochet
