#pragma once

#include <string>

#include "bench/control/replay.h"

namespace ricochet {

// Derivatives of (q, v)(T) with respect to the controls of an optimal control problem, 2 n_q x (n_u N), the controls of
// one interval after those of the other.

/// Gradient by central differences of fourth order of a replay, for any solver; they are exact to about its error over
/// `change`.
/// @param change  of a control, relative to the larger of its size and 1
/// @throws std::runtime_error when a replay fails
Matrix gradient_by_differences(const OptimalControlProblem& problem, const ControlTrajectory& trajectory,
                               const IntervalSolver& solve, double change);

/// Gradient by a method with sensitivities, interval by interval with the chain rule
///
///   dx_{k+1}/du_j = dx_{k+1}/dx_k dx_k/du_j,   j < k,                                                       (1)
///
/// and dx_{k+1}/du_k from the interval itself, with the control as a parameter.
/// @param steps  per interval
/// @throws std::runtime_error when a step fails
Matrix gradient_by_sensitivities(const OptimalControlProblem& problem, const ControlTrajectory& trajectory,
                                 const std::string& method, int steps);

/// A solver of one interval with a fixed number of steps.
IntervalSolver fixed_step_solver(const std::string& method, int steps);

}  // namespace ricochet
