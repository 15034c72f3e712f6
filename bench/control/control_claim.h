#pragma once

#include "bench/control/control_options.h"
#include "bench/control/control_run.h"
#include "methods/control/control_solution.h"
#include "problems/control/optimal_control_problem.h"

namespace ricochet {

/// Writes the claims of an optimal control solution to `run`: cost, motion, controls, forces and impulses.
void describe_claim(const OptimalControlProblem& problem, const ControlSolution& solution, ControlRun& run);

/// Solves a problem, describes the solution and replays its controls: with the event-located reference, or with the pivoting
/// solver if that declines. A run that is not solved has a status and a message instead.
/// @param command  that reproduces the run. @param has_replay  false: no replay. @throws InputError
ControlRun solve_and_replay(const ControlOptions& options, const std::string& command, bool has_replay = true);

}  // namespace ricochet
