#pragma once

#include <random>

#include "methods/control/control_solver.h"
#include "methods/control/rollout.h"
#include "methods/fesd/pivoting_solver.h"

namespace ricochet {

/// Model predictive control of a task that ends at T: the plant runs the first interval of the plan, and the rest is
/// planned again from the state reached,
///
///   min  int_{t_k}^T L dt + E   subject to   (q, v)(t_k) = the plant's,   t_k = k T / N.                      (1)
///
/// The horizon shrinks, since E and the terminal constraints belong to the time T: the rest of an optimal plan is then
/// optimal for the rest of the task (Bellman), and without disturbance nothing changes, which a test checks. With a
/// horizon of constant length every step would be another task.
///
/// If T is free, it is also free in (1): N times the length of the remaining intervals.
class ShrinkingHorizon {
 public:
  /// @param problem, solver  must outlive this object. @throws InputError for a plant with formulas that bend or jump
  ShrinkingHorizon(const OptimalControlProblem& problem, ControlSolver& solver);

  /// The plan for the whole task, from the first guess of the solver.
  ControlSolution solve();

  /// The plant runs one interval of the plan, by the pivoting solver. @return its status
  Status advance();

  /// Moves the plant: positions by up to `size` [m, rad], velocities by up to `size` times their own. Closed contacts
  /// stay closed, so bodies at rest stay at rest. Open ones stay open: `size` is halved until they do.
  void disturb(double size, std::mt19937& random);

  /// Solves (1) from the state of the plant. A solution that has no plan leaves the one before in force.
  ControlSolution resolve();

  int interval() const { return k_; }  ///< of the plant, from 0; N at the end
  const Vector& q() const { return q_; }
  const Vector& v() const { return v_; }
  const ControlTrajectory& plan() const { return plan_; }
  double cost_so_far() const { return past_.cost; }  ///< of the plant, without E
  double cost_to_go() const;                         ///< of the plan from interval() on
  double terminal_cost() const;                      ///< of the plant where it is

 private:
  ControlSolution take(ControlSolution solution);

  const OptimalControlProblem& problem_;
  ControlSolver& solver_;
  const Transcription::Simulation simulation_;
  ControlledPlant plant_;
  Counters counters_;
  PivotingSolver pivoting_;
  int k_ = 0;
  Vector q_, v_;
  ControlTrajectory plan_;
  Rollout past_;
};

}  // namespace ricochet
