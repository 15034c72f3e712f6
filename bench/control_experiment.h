#pragma once

#include <string>

namespace ricochet {

/// Runs an experiment of optimal control, a file in bench/experiments/ with one of these kinds, and returns the path of
/// its results file:
///
///   "optimal_control"    solves problems with FESD-J, and with time stepping with the same number of variables, and
///                        replays the controls. "runs": [{"problem", "fesd", "time_stepping"}], the last two with the
///                        arguments of `ricochet control`
///   "control_gradient"   derivatives of a terminal state with respect to the controls. "problem", "control": one
///                        list of controls per interval, "methods": [{"method", "steps"}], steps per interval
///   "control_growth"     the work of a solve, control_growth.h
///   "scale"              the time of a step of scenes of growing size (scale.h)
///   "control_seeds"      solves problems from random initial guesses (control_seeds.h)
///
/// Results of the same experiment by the same program are taken as they are.
/// @throws InputError with file and field
std::string run_control_experiment(const std::string& name, const std::string& folder);

}  // namespace ricochet
