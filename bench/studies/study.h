#pragma once

#include <string>

namespace ricochet {

/// Runs an experiment whose runs have no grid of steps or a measure of their own, a file in bench/experiments/ with one
/// of these kinds, and returns the path of its results file:
///
///   "optimal_control", "control_gradient"   control_experiment.h
///   "control_growth"                        control_growth.h
///   "control_seeds"                         control_seeds.h
///   "scale"                                 scale.h
///   "zeno"                                  zeno_study.h
///   "friction_ramp"                         friction_ramp.h
///
/// Results of the same experiment by the same program are taken as they are.
/// @throws InputError with file and field
std::string run_study(const std::string& name, const std::string& folder);

}  // namespace ricochet
