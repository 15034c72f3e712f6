#pragma once

#include <functional>
#include <string>
#include <vector>

#include "methods/control/transcription.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Motion of the plant under the controls of an optimal control solution.
struct Replay {
  Status status = Status::success;
  std::string message;
  Vector q, v;                                   ///< at T
  double cost = 0;                               ///< (1) of optimal_control_problem.h
  double penetration = 0;                        ///< deepest at any time [m, or the unit of the gap]
  std::vector<Event> events;                     ///< times from 0
  std::vector<ControlTrajectory::Point> points;  ///< at the ends of the intervals
};

/// Solves one interval.
using IntervalSolver = std::function<Solution(const Problem&)>;

/// Runs the controls open loop, interval by interval.
Replay replay(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, const IntervalSolver& solve);

/// The event-located reference with CVODE, independent of all methods.
IntervalSolver reference_solver(double tolerance);
/// FESD-J with error control, solved by pivoting.
IntervalSolver pivoting_solver(double tolerance);

/// Differences between an optimal control solution and its replay.
struct ReplayMismatch {
  double terminal = 0;  ///< max-norm of the difference of (q, v) at T
  double events = 0;    ///< largest difference of impact times [s]; infinite if their number or contacts differ
  double cost = 0;      ///< true minus claimed
};
ReplayMismatch mismatch(const OptimalControlProblem& problem, const ControlTrajectory& claimed, const Replay& truth);

/// Threshold of impulses that count as impacts, relative to the largest momentum: a transcription, and a contact that
/// closes softly, have tiny impulses.
double smallest_impact(const OptimalControlProblem& problem, const ControlTrajectory& trajectory);

}  // namespace ricochet
