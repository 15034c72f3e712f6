#include "methods/control/time_stepping_transcription.h"

#include <fmt/format.h>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/join.h"

namespace ricochet {
namespace {

// A contact presses with more than this part of the largest impulse of the motion; the rest is what complementarity
// leaves.
constexpr double kPresses = 1e-6;

}  // namespace

TimeSteppingTranscription::TimeSteppingTranscription(const OptimalControlProblem& problem, const Options& options)
    : Transcription(problem, {make_tableau("radau-iia", 3), {.n_fe = 2, .as_needed = true}}),
      steps_(options.steps),
      equations_(*problem.plant, options.equations, mpcc_) {
  const ProblemInfo& info = problem.plant->info();
  equations_.set_bounds({problem.q.lower, problem.q.upper, problem.v.lower, problem.v.upper});
  u_ = add_controls();
  T_ = add_time();
  const double h = info.end_time / (problem.n_intervals * steps_);
  // With T free one length serves all steps; with T fixed it is a constant.
  const int length = mpcc_.nlp.add_variable(T_ >= 0 ? 0 : h, T_ >= 0 ? kInfinity : h, h, "h");
  if (T_ >= 0) {
    const int row = mpcc_.nlp.add_row(0, 0, "sum of h");
    mpcc_.nlp.add_block(std::make_unique<LinearBlock>(
        row, std::vector<std::pair<int, double>>{{length, problem.n_intervals * steps_}, {T_, -1}}));
  }
  begin_sections();
  auto point = equations_.add_initial_state(info.q0, info.v0);
  end_section(point);
  for (int k = 0; k < problem.n_intervals; ++k) {
    for (int j = 0; j < steps_; ++j) {
      point = equations_.add_step(point, u_[k], length);
      mpcc_.nlp.add_block(std::make_unique<QuadratureBlock>(problem.running_cost, 1, length,
                                                            join<int>({point.q, point.v, u_[k]})));  // (1)
      add_path(point.q, point.v, u_[k], fmt::format("interval {}, step {}", k + 1, j + 1));
    }
    end_section(point);
  }
  add_terminal(point.q, point.v);
}

ControlTrajectory TimeSteppingTranscription::trajectory(const Vector& x) const {
  ControlTrajectory trajectory = read_controls(x);
  const ProblemInfo& info = problem_.plant->info();
  const int n = problem_.n_intervals * steps_;
  const double h = trajectory.T / n;
  trajectory.points.push_back({0, info.q0, info.v0});
  Matrix impulses(info.n_c(), n);
  for (int k = 0; k < n; ++k) {
    const Vector q = equations_.position(x, k), v = equations_.velocity(x, k);
    trajectory.interval_cost[k / steps_] += h * problem_.running_cost.at(q, v, trajectory.u.col(k / steps_))[0];
    impulses.col(k) = equations_.normal_impulse(x, k);
    trajectory.points.push_back({(k + 1) * h, q, v, impulses.col(k) / h, equations_.tangential_impulse(x, k) / h});
  }
  const ControlTrajectory::Point& end = trajectory.points.back();
  trajectory.objective = trajectory.interval_cost.sum() + problem_.terminal_cost.at(end.q, end.v)[0];
  const Vector initial_gap = problem_.plant->gap(info.q0);
  // A contact that presses and did not in the step before has closed in between.
  const double least = kPresses * impulses.maxCoeff();
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < info.n_c(); ++i) {
      const bool pressed = k == 0 ? initial_gap[i] <= 0 : impulses(i, k - 1) > least;
      if (impulses(i, k) > least && !pressed) trajectory.impulses.push_back({(k + 1) * h, i, impulses(i, k)});
    }
  }
  return trajectory;
}

Status TimeSteppingTranscription::guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) {
  const double h = H / steps_;
  for (int j = 0; j < steps_; ++j) {
    const Vector q_k = q, v_k = v;
    const Status status = solver.advance(h);
    if (status != Status::success) return status;
    const MeanForces forces = mean_forces(solver.step(), simulation_.tableau);
    q = solver.step().last().q1;
    v = solver.step().last().v1;
    equations_.set_guess(k * steps_ + j, h, q_k, v_k, q, v, forces.lambda_n, forces.lambda_t);
  }
  return Status::success;
}

}  // namespace ricochet
