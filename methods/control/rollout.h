#pragma once

#include "methods/elements/fesd_step.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/control/replay_problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Motion of the plant under given controls.
struct Rollout {
  Status status = Status::success;
  int n_solved = 0;      ///< intervals
  double cost = 0;       ///< (1) of optimal_control_problem.h, by the tableau's quadrature
  double violation = 0;  ///< of bounds and path constraints, summed and integrated over time; plus |r| at T
};

/// Adds cost and violation of a step of FESD-J under the control u, by the quadrature of its tableau.
void add_step(const OptimalControlProblem& problem, const FesdStep& step, const ButcherTableau& tableau,
              const Vector& u, Rollout& rollout);

/// Runs FESD-J with n_fe elements on each interval, or more where a motion has more switches, solved by pivoting: the
/// equations of a FesdTranscription.
/// @param plant  of `problem`; @param u  n_u x N
Rollout roll_out(const OptimalControlProblem& problem, ControlledPlant& plant, const ButcherTableau& tableau, int n_fe,
                 const Matrix& u);

}  // namespace ricochet
