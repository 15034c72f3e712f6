#pragma once

#include "bench/studies/control/control_run.h"
#include "methods/control/transcription.h"
#include "problems/control/optimal_control_problem.h"

namespace ricochet {

/// Writes the claims of an optimal control solution to `run`: cost, motion, controls, forces, impulses, and the frames
/// of the motion if the problem has a picture.
void describe_claim(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, ControlRun& run);

}  // namespace ricochet
