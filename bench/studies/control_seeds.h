#pragma once

#include <nlohmann/json.hpp>

#include "bench/results_file.h"

namespace ricochet {

/// Solves optimal control problems from random initial guesses, the seeds 1 to n of each, one run after the other. A
/// run is a row of the file as soon as it is finished; rows that the file took over are not run again.
///
/// @param document  "runs": [{"problem", "arguments": of `ricochet control`, without --seed and --time-limit, "seeds":
///                  n, "time_limit": wall time of a run [s]}]
/// @throws InputError with the field, before anything is run
void study_seeds(const nlohmann::json& document, ResultsFile& file);

}  // namespace ricochet
