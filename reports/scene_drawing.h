#pragma once

#include <string>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// A scene as SVG, from its geometry: where it starts, the ways that the centres of its bodies take, and an animation of
/// the motion, which needs no script. Down is where gravity points; space is seen from a height of 20 degrees. A surface
/// that moves by itself follows the scene's gap.
/// @param solution  of the problem, whose motion and impacts are shown; without a motion the scene as it starts
/// @throws InputError for a scene without geometry
std::string scene_svg(const Problem& problem, const Solution& solution = {});

}  // namespace ricochet
