#include "methods/control/control_trajectory.h"

namespace ricochet {

void add_step(const OptimalControlProblem& problem, const FesdStep& step, const ButcherTableau& tableau, int k,
              double t, ControlTrajectory& trajectory) {
  const ProblemInfo& info = problem.plant->info();
  trajectory.interval_cost[k] = 0;
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& e = step.elements[n];
    for (int i = 0; i < info.n_c(); ++i) {
      const ContactInfo& contact = info.contacts[i];
      trajectory.impulses.push_back(
          {t, i, step.Lambda_n(i, n), step.Lambda_t.col(n).segment(contact.tangent_index, contact.n_t)});
    }
    trajectory.points.push_back({t, e.q0, step.v_minus.col(n)});
    trajectory.points.push_back({t, e.q0, e.v0});
    for (int j = 0; j < tableau.n_s; ++j) {
      trajectory.points.push_back(
          {t + tableau.c[j] * e.h, e.q.col(j), e.v.col(j), e.lambda_n.col(j), e.lambda_t.col(j)});
      trajectory.interval_cost[k] +=
          e.h * tableau.b[j] * problem.running_cost.at(e.q.col(j), e.v.col(j), trajectory.u.col(k))[0];
    }
    t += e.h;
  }
}

void add_end(const OptimalControlProblem& problem, const FesdStep& last, double t, ControlTrajectory& trajectory) {
  const Element& end = last.last();
  const Eigen::Index stage = end.lambda_n.cols() - 1;
  trajectory.points.push_back({t, end.q1, end.v1, end.lambda_n.col(stage), end.lambda_t.col(stage)});
  trajectory.objective = trajectory.interval_cost.sum() + problem.terminal_cost.at(end.q1, end.v1)[0];
}

}  // namespace ricochet
