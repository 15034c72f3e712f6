#pragma once

#include <nlohmann/json.hpp>

#include "bench/results_file.h"

namespace ricochet {

/// Experiment kind "scale": the time of a step of methods on scenes of growing size. "steps"; "time_limit" of a run
/// [s]; "runs": [{"problem", "scene": its name in the report, "set": {parameter: value}, "set_per_n": {parameter: value
/// for n = 1}, "sizes": values of the parameter n, "methods"}]. Behind a size that a method does not finish, larger
/// ones are rows that say so. An interrupted study is continued behind the last curve that is complete.
void study_scale(const nlohmann::json& document, ResultsFile& file);

}  // namespace ricochet
