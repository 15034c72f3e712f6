#pragma once

#include <nlohmann/json.hpp>

#include "bench/results_file.h"

namespace ricochet {

/// An experiment of kind "control_growth": how the work of an optimal control solve grows with the number of control
/// intervals, step by step of its homotopy, and what a second solve takes after the plant has run one interval and its
/// positions were moved by up to "disturbance". "runs": [{"problem", "arguments" of `ricochet control`, "intervals": a
/// list; without it the problem's own}]
void measure_growth(const nlohmann::json& document, ResultsFile& file);

}  // namespace ricochet
