#pragma once

#include <nlohmann/json.hpp>

#include "bench/results_file.h"

namespace ricochet {

/// An experiment of kind "optimal_control": solves problems with FESD-J, and with time stepping with the same number of
/// variables, and replays the controls. "runs": [{"problem", "fesd", "time_stepping"}], the last two with the arguments
/// of `ricochet control`
void compare_transcriptions(const nlohmann::json& document, ResultsFile& file);

/// An experiment of kind "control_gradient": derivatives of a terminal state with respect to the controls. "problem",
/// "control": one list of controls per interval, "methods": [{"method", "steps"}], steps per interval
void compare_gradients(const nlohmann::json& document, ResultsFile& file);

}  // namespace ricochet
