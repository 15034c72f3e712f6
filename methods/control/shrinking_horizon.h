#pragma once

#include <random>

#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/rollout.h"
#include "methods/control/transcription.h"

namespace ricochet {

/// Model predictive control of a task that ends at T: the plant runs the first interval of the plan, and the rest is
/// planned again from the state reached,
///
///   min  int_{t_k}^T L dt + E   subject to   (q, v)(t_k) = the plant's,   t_k = k T / N.                      (1)
///
/// The horizon shrinks, since E and the terminal constraints belong to the time T: the rest of an optimal plan is then
/// optimal for the rest of the task (Bellman), and without disturbance nothing changes, which a test checks. With a
/// horizon of constant length every step would be another task. The program stays the same: the past is constant
/// (Transcription::start_at), so functions, structure, and the numbers of variables are reused, the plan itself is the
/// guess, and the last branch is solved first (MpccSolver::resolve).
///
/// If T is free, it is also free in (1): N times the length of the remaining intervals.
class ShrinkingHorizon {
 public:
  /// @param problem, transcription  must outlive this object. @throws InputError for options out of
  /// range, and for a plant with formulas that bend or jump
  ShrinkingHorizon(const OptimalControlProblem& problem, Transcription& transcription, const HomotopyOptions& options);

  /// The plan for the whole task, from the guess of the transcription.
  MpccSolution solve(const MpccSolver::Progress& progress = {});

  /// The plant runs one interval of the plan, by the pivoting solver. @return its status
  Status advance();

  /// Moves the plant: positions by up to `size` [m, rad], velocities by up to `size` times their own. Closed contacts
  /// stay closed, so bodies at rest stay at rest. Open ones stay open: `size` is halved until they do.
  void disturb(double size, std::mt19937& random);

  /// Solves (1) from the state of the plant. If this fails, the plan is unchanged.
  MpccSolution resolve(const MpccSolver::Progress& progress = {});

  int interval() const { return k_; }  ///< of the plant, from 0; N at the end
  const Vector& q() const { return q_; }
  const Vector& v() const { return v_; }
  const ControlTrajectory& plan() const { return plan_; }
  double cost_so_far() const { return past_.cost; }  ///< of the plant, without E
  double cost_to_go() const;                         ///< of the plan from interval() on
  double terminal_cost() const;                      ///< of the plant where it is

 private:
  MpccSolution take(MpccSolution solution);

  const OptimalControlProblem& problem_;
  Transcription& transcription_;
  MpccSolver solver_;
  ControlledPlant plant_;
  Counters counters_;
  PivotingSolver pivoting_;
  int k_ = 0;
  Vector q_, v_, x_;  // x_: of the plan
  ControlTrajectory plan_;
  Rollout past_;
};

}  // namespace ricochet
