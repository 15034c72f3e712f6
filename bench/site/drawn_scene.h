#pragma once

#include <memory>

#include "problems/problem.h"

namespace ricochet {

/// A certified case with its geometry for drawings (reference/truths.h): the same coordinates and motion. Null for other
/// problems.
/// @throws InputError for a geometry that does not fit the scene
std::unique_ptr<Problem> with_picture(const Problem& problem);

}  // namespace ricochet
