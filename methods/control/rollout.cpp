#include "methods/control/rollout.h"

#include <algorithm>

namespace ricochet {
namespace {

double violation(const Eigen::Ref<const Vector>& x, const OptimalControlProblem::Bounds& bounds) {
  return (x - bounds.upper).cwiseMax(0).sum() + (bounds.lower - x).cwiseMax(0).sum();
}

}  // namespace

void add_step(const OptimalControlProblem& problem, const FesdStep& step, const ButcherTableau& tableau,
              const Vector& u, Rollout& rollout) {
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& e = step.elements[static_cast<std::size_t>(n)];
    for (int j = 0; j < tableau.n_s; ++j) {
      const double weight = e.h * tableau.b[j];
      rollout.cost += weight * problem.running_cost.at(e.q.col(j), e.v.col(j), u)[0];
      rollout.violation += weight * (violation(e.q.col(j), problem.q) + violation(e.v.col(j), problem.v) +
                                     (-problem.path.at(e.q.col(j), e.v.col(j), u)).cwiseMax(0).sum());
    }
  }
}

RolloutRunner::RolloutRunner(const OptimalControlProblem& problem, const ButcherTableau& tableau, int n_fe)
    : problem_(problem),
      tableau_(tableau),
      plant_(problem),
      solver_(plant_, tableau_, {.n_fe = n_fe, .as_needed = true}, counters_) {}

Rollout RolloutRunner::run(const Matrix& u) {
  const ProblemInfo& info = plant_.info();
  const int N = static_cast<int>(u.cols());
  Rollout result;
  plant_.set_control(u.col(0));
  solver_.start(info.q0, info.v0);
  for (int k = 0; k < N; ++k) {
    plant_.set_control(u.col(k));
    result.status = solver_.advance(info.end_time / N);
    if (result.status != Status::success) return result;
    add_step(problem_, solver_.step(), tableau_, u.col(k), result);
    ++result.n_solved;
  }
  const Element& last = solver_.step().last();
  result.cost += problem_.terminal_cost.at(last.q1, last.v1)[0];
  result.violation += problem_.terminal.at(last.q1, last.v1).cwiseAbs().sum();
  return result;
}

}  // namespace ricochet
