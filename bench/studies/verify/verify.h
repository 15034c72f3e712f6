#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/verify/check.h"

namespace ricochet {

// Study "verify": a battery of checks for each method, with a scorecard. Fields of the experiment: "orders", "truth",
// "promises", "allocation", "hard_cases", the grids "first_order_steps", "high_order_steps", "tolerances", "time_limit"
// of a check, and "methods".

/// The checks of an experiment of this kind, in their order. @throws InputError
std::vector<Check> battery_of(const nlohmann::json& experiment);

/// @throws InputError for a method that cannot be made
Subject subject_of(const std::string& method, double time_limit);

}  // namespace ricochet
