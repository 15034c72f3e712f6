#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/registry.h"
#include "reference/ground_truth.h"

/// @file
/// Solutions known to many digits: known_solution(). The cases of reference/data/ground_truth.json are in the program,
/// with their solutions; they register themselves as scenes (problems/registry.h). Other files of reference/data/ and of
/// users state scenes and solutions in the same format, and are read when they are named.

namespace ricochet::reference {

inline const char* const kCertifiedFile = "reference/data/ground_truth.json";

/// The certified cases of kCertifiedFile.
const std::vector<GroundTruth>& certified_cases();

/// The solution of a problem, where one is known to many digits.
/// @param problem     id of a scene, or FILE.json#ID of a scene file; a file that states scenes alone has no solutions
/// @param parameters  that are changed. A solution belongs to the default parameters.
/// @throws InputError for a file that cannot be read, and for an unknown scene or parameter
std::optional<GroundTruth> known_solution(const std::string& problem, const ParameterChanges& parameters);

/// Geometry for drawings of a certified case, whose scene is stated by formulas alone: the field "geometry" of a scene
/// file, as JSON. Empty for other scenes.
std::string picture_of(const std::string& scene);

}  // namespace ricochet::reference
