#pragma once

#include "bench/control/control_run.h"
#include "methods/control/control_solution.h"
#include "problems/control/optimal_control_problem.h"

namespace ricochet {

/// Writes the claims of an optimal control solution to `run`: cost, motion, controls, forces and impulses.
void describe_claim(const OptimalControlProblem& problem, const ControlSolution& solution, ControlRun& run);

}  // namespace ricochet
