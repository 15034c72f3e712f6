#pragma once

#include <string>
#include <vector>

#include "problems/motion.h"
#include "problems/problem.h"

namespace ricochet {

/// A scene as SVG, from its geometry: where it starts, the ways that the centres of its bodies take, and an animation of
/// the `motion`, which needs no script. Down is where gravity points; space is seen from a height of 20 degrees. A surface
/// that moves by itself follows the scene's gap.
/// @param motion   of the run; where it is empty the scene is drawn as it starts
/// @param impacts  [s], marks on the time line
/// @throws InputError for a scene without geometry
std::string scene_svg(const Problem& problem, const Motion& motion, const std::vector<double>& impacts);

}  // namespace ricochet
