#pragma once

#include <vector>

#include "methods/elements/fesd_step.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/control/optimal_control_problem.h"

namespace ricochet {

/// Controls and motion of a solved optimal control problem.
struct ControlTrajectory {
  Matrix u;              ///< n_u x N, constant on each interval
  double T = 0;          ///< [s]
  double objective = 0;  ///< (1) of optimal_control_problem.h as the discretisation integrates it
  Vector interval_cost;  ///< N, what each interval adds to it; the rest is the terminal cost

  /// A point of the discrete motion; at an impact two with the same t.
  struct Point {
    double t = 0;
    Vector q, v;
    Vector lambda_n = {}, lambda_t = {};  ///< n_c, n_lambda_t; empty where the discretisation has no force
  };
  struct Impulse {
    double t = 0;
    int contact = -1;
    double Lambda_n = 0;   ///< [N s]
    Vector Lambda_t = {};  ///< n_t of the contact [N s]
  };
  std::vector<Point> points;
  std::vector<Impulse> impulses;
};

/// Adds the motion of a step of FESD-J to a trajectory that has its controls, and sets the cost of interval k.
/// @param t  start of the step [s]
void add_step(const OptimalControlProblem& problem, const FesdStep& step, const ButcherTableau& tableau, int k,
              double t, ControlTrajectory& trajectory);

/// Adds the right end of the last step as the last point, and sets the objective.
void add_end(const OptimalControlProblem& problem, const FesdStep& last, double t, ControlTrajectory& trajectory);

}  // namespace ricochet
