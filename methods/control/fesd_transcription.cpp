#include "methods/control/fesd_transcription.h"

#include <fmt/format.h>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/join.h"

namespace ricochet {

FesdTranscription::FesdTranscription(const OptimalControlProblem& problem, const ButcherTableau& tableau,
                                     const FesdEquations::Options& options)
    : Transcription(problem, {tableau, {.n_fe = options.n_fe, .as_needed = true}}),
      tableau_(tableau),
      n_fe_(options.n_fe),
      equations_(*problem.plant, tableau, options, mpcc_) {
  const ProblemInfo& info = problem.plant->info();
  equations_.set_bounds({problem.q.lower, problem.q.upper, problem.v.lower, problem.v.upper});
  u_ = add_controls();
  T_ = add_time();
  begin_sections();
  FesdEquations::Point point = equations_.add_initial_state(info.q0, info.v0);
  end_section(point);
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
    end_section(point);
  }
  add_terminal(point.q, point.v);
}

ControlTrajectory FesdTranscription::trajectory(const Vector& x) const {
  ControlTrajectory trajectory = read_controls(x);
  double t = 0;
  for (int k = 0; k < problem_.n_intervals; ++k) {
    const FesdStep step = equations_.read(x, k);
    add_step(problem_, step, tableau_, k, t, trajectory);
    for (int n = 0; n < step.n_elements; ++n) t += step.elements[n].h;
    if (k + 1 == problem_.n_intervals) add_end(problem_, step, t, trajectory);
  }
  return trajectory;
}

std::vector<int> FesdTranscription::lengths() const {
  std::vector<int> result;
  for (const auto& interval : equations_.intervals()) {
    for (const auto& element : interval) {
      if (interval.size() > 1) result.push_back(element.h);
    }
  }
  return result;
}

Status FesdTranscription::guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) {
  Status status = solver.advance(H);
  if (status != Status::success) return status;
  FesdStep step = solver.step();
  const Vector q_end = step.last().q1, v_end = step.last().v1;
  if (step.n_elements != n_fe_) {  // it needed more elements
    solver.start(q, v);
    status = sample(solver, H, q, v, step);
  }
  if (status != Status::success) return status;
  equations_.set_guess(step, k);
  q = q_end;
  v = v_end;
  return Status::success;
}

/// A step of N_FE equal elements whose stages are points of a motion; the forces are their means between them.
Status FesdTranscription::sample(PivotingSolver& solver, double H, Vector q, Vector v, FesdStep& step) const {
  const double h = H / n_fe_;
  step = FesdStep();
  step.resize(*problem_.plant, tableau_.n_s, n_fe_);
  step.H = H;
  step.n_elements = n_fe_;
  for (int n = 0; n < n_fe_; ++n) {
    Element& element = step.elements[n];
    element.h = h;
    element.q0 = q;
    element.v0 = v;
    step.v_minus.col(n) = v;
    double c = 0;
    for (int j = 0; j < tableau_.n_s; ++j) {
      const double duration = (tableau_.c[j] - c) * h;
      const Status status = solver.advance(duration);
      if (status != Status::success) return status;
      const MeanForces forces = mean_forces(solver.step(), tableau_);
      element.q.col(j) = solver.step().last().q1;
      element.v.col(j) = solver.step().last().v1;
      element.a.col(j) = (element.v.col(j) - v) / duration;
      element.lambda_n.col(j) = forces.lambda_n;
      element.lambda_t.col(j) = forces.lambda_t;
      q = element.q.col(j);
      v = element.v.col(j);
      c = tableau_.c[j];
    }
    if (c < 1) {
      const Status status = solver.advance((1 - c) * h);
      if (status != Status::success) return status;
      q = solver.step().last().q1;
      v = solver.step().last().v1;
    }
    element.q1 = q;
    element.v1 = v;
  }
  return Status::success;
}

}  // namespace ricochet
