#include "methods/control/fesd_transcription.h"

#include <fmt/format.h>

#include "methods/control/nlp_blocks.h"
#include "methods/control/rollout.h"
#include "problems/join.h"

namespace ricochet {

FesdTranscription::FesdTranscription(const OptimalControlProblem& problem, const ButcherTableau& tableau,
                                     const FesdEquations::Options& options)
    : Transcription(problem),
      tableau_(tableau),
      n_fe_(options.n_fe),
      equations_(*problem.plant, tableau, options, mpcc_) {
  const ProblemInfo& info = problem.plant->info();
  equations_.set_bounds({problem.q.lower, problem.q.upper, problem.v.lower, problem.v.upper});
  u_ = add_controls();
  T_ = add_time();
  FesdEquations::Point point = equations_.add_initial_state(info.q0, info.v0);
  for (int k = 0; k < problem.n_intervals; ++k) {
    point = equations_.add_interval(point, u_[k], info.end_time / problem.n_intervals, T_, 1.0 / problem.n_intervals);
    for (const auto& element : equations_.intervals().back()) {
      for (int j = 0; j < tableau_.n_s; ++j) {
        const auto& at = element.stages[j].point;
        const std::vector<int> arguments = join<int>({at.q, at.v, u_[k]});
        mpcc_.nlp.add_block(
            std::make_unique<QuadratureBlock>(problem.running_cost, tableau_.b[j], element.h, arguments));  // (1)
        add_path(at.q, at.v, u_[k], fmt::format("interval {}, stage {}", k + 1, j + 1));
      }
    }
  }
  add_terminal(point.q, point.v);
}

ControlTrajectory FesdTranscription::trajectory(const Vector& x) const {
  ControlTrajectory trajectory = read_controls(x);
  const ProblemInfo& info = problem_.plant->info();
  double t = 0;
  for (int k = 0; k < problem_.n_intervals; ++k) {
    const FesdStep step = equations_.read(x, k);
    for (int n = 0; n < step.n_elements; ++n) {
      const Stages& e = step.elements[n];
      for (int i = 0; i < info.n_c(); ++i) trajectory.impulses.push_back({t, i, step.Lambda_n(i, n)});
      trajectory.points.push_back({t, e.q0, step.v_minus.col(n)});
      trajectory.points.push_back({t, e.q0, e.v0});
      for (int j = 0; j < tableau_.n_s; ++j) {
        trajectory.points.push_back({t + tableau_.c[j] * e.h, e.q.col(j), e.v.col(j)});
        trajectory.objective += e.h * tableau_.b[j] * running_cost(e.q.col(j), e.v.col(j), trajectory.u.col(k));
      }
      t += e.h;
    }
    if (k + 1 == problem_.n_intervals) trajectory.points.push_back({t, step.last().q1, step.last().v1});
  }
  trajectory.objective += terminal_cost(trajectory.points.back().q, trajectory.points.back().v);
  return trajectory;
}

Status FesdTranscription::set_guess(const Matrix& u) {
  for (std::size_t k = 0; k < u_.size(); ++k) {
    for (std::size_t c = 0; c < u_[k].size(); ++c) mpcc_.nlp.variables[u_[k][c]].guess = u(c, k);
  }
  const auto set_interval = [&](int k, const FesdStep& step) { equations_.set_guess(step, k); };
  return roll_out(problem_, tableau_, n_fe_, u, set_interval).status;
}

}  // namespace ricochet
