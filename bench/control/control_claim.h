#pragma once

#include "bench/studies/control/control_run.h"
#include "methods/control/transcription.h"
#include "problems/control/optimal_control_problem.h"

namespace ricochet {

/// Writes what an optimal control solution claims into `run`: cost, motion, controls, forces, impulses, and the motion
/// as it looks when the problem has a picture.
void describe_claim(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, ControlRun& run);

}  // namespace ricochet
