#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// The points of a gnuplot script's data blocks as CSV: the title of their panel, the labels of its axes, the name of
/// their curve or of their block, the number of the piece of it, as gaps part it, and the columns of the block. Empty for
/// a script without blocks.
std::string gnuplot_csv(const std::string& script);

/// q and v over t of a row's motion, as CSV. Empty for a row without a motion.
std::string motion_csv(const nlohmann::json& row);

}  // namespace ricochet
