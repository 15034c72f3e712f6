#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// q and v over t of a row's motion, as CSV. Empty for a row without a motion.
std::string motion_csv(const nlohmann::json& row);

}  // namespace ricochet
