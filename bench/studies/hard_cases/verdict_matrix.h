#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/hard_cases/hard_cell.h"

namespace ricochet {

/// The matrix of verdicts for a reader who chooses methods, groups of cases and verdicts (reports/site/src/verdicts.js). A
/// cell has its verdict, the number that decided it, and the command that repeats it.
nlohmann::json verdict_matrix(const std::vector<HardCell>& cells, const std::string& experiment);

}  // namespace ricochet
