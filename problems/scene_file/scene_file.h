#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"

/// @file
/// Scenes from JSON files: read_scene_file().

namespace ricochet {

/// Reads a scene from a JSON file; no compiler needed. The file holds the scene itself, or an object with the scene
/// under "problem", or a set of such objects under "cases" from which `FILE#id` picks one. A scene has the fields
///
///     q0, v0, T, M, f                                  the equations of motion, required
///     geometry                                         from which M, f, gaps and tangents follow where they are not stated
///     params, units, Bu, u, contacts, potential_energy, id, title, source, hard_feature
///
/// which scene.schema.json in this folder describes, and README.md beside it shows. What the schema does not know is
/// refused.
///
/// The name t is the time [s]. Expressions are in Python's syntax (parse_expression). Numbers may also be written as
/// JSON numbers.
/// @param path     of the file, perhaps with `#id`
/// @param changes  other values of the scene's parameters
/// @throws InputError that names the file, the field and the position
std::unique_ptr<Problem> read_scene_file(const std::string& path, const ParameterChanges& changes = {});

/// The same for the `text` of a scene, with the parameters of `changes`. In messages `name` stands for the file.
/// @throws InputError as read_scene_file()
std::unique_ptr<Problem> read_scene_text(const std::string& text, const std::string& name,
                                         const ParameterChanges& changes = {});

}  // namespace ricochet
