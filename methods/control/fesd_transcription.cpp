#include "methods/control/fesd_transcription.h"

#include <fmt/format.h>

#include "methods/control/nlp_blocks.h"
#include "methods/fesd/pivoting_solver.h"
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
      if (!tableau_.is_stiffly_accurate()) trajectory.points.push_back({t, e.q1, e.v1});
    }
  }
  trajectory.objective += terminal_cost(trajectory.points.back().q, trajectory.points.back().v);
  return trajectory;
}

Status FesdTranscription::guess_from_simulation() {
  const ProblemInfo& info = problem_.plant->info();
  Counters counters;
  PivotingSolver solver(*problem_.plant, tableau_, {.n_fe = n_fe_}, counters);
  solver.start(info.q0, info.v0);
  for (int k = 0; k < problem_.n_intervals; ++k) {
    const Status status = solver.advance(info.end_time / problem_.n_intervals);
    if (status != Status::success) return status;
    equations_.set_guess(solver.step(), k);
  }
  return Status::success;
}

}  // namespace ricochet
