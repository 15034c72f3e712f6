#pragma once

#include <memory>

#include "problems/problem.h"

namespace ricochet {

/// A scene that is stated by formulas alone, with the geometry that problems/scene_file/ground_truth_pictures.json gives it
/// for drawings: the same coordinates and motion. Null where there is none, as beside an installed program.
/// @throws InputError for a geometry that does not fit the scene
std::unique_ptr<Problem> with_picture(const Problem& problem);

}  // namespace ricochet
