#pragma once

#include "methods/fesd/pivoting_solver.h"
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

/// Runs a plant by FESD-J with n_fe elements on each interval, or more where a motion has more switches, solved by
/// pivoting: the equations of a FesdTranscription. What the solver knows of the plant is kept from one run to the next,
/// and no run depends on those before it.
class RolloutRunner {
 public:
  /// @param problem  must outlive this object
  RolloutRunner(const OptimalControlProblem& problem, const ButcherTableau& tableau, int n_fe);
  RolloutRunner(const RolloutRunner&) = delete;

  /// @param u  n_u x N
  Rollout run(const Matrix& u);

 private:
  const OptimalControlProblem& problem_;
  const ButcherTableau tableau_;
  ControlledPlant plant_;
  Counters counters_;
  PivotingSolver solver_;
};

}  // namespace ricochet
