#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

/// Reads a scene from a JSON file; no compiler needed. The file holds the scene itself, or an object with the scene
/// under "problem", or a set of such objects under "cases" from which `FILE#id` picks one. A scene has the fields
///   q0, v0, T, M, f                                  the equations of motion, required
///   params, units, Bu, u, contacts, potential_energy, id, title, source, hard_feature
///
/// which scene.schema.json in this folder describes, and README.md beside it shows. What the schema does not know is
/// refused.
///
/// The name t is the time [s]. Expressions are in Python's syntax (parse_expression). Numbers may also be written as
/// JSON numbers.
/// @throws InputError that names the file, the field and the position
std::unique_ptr<Problem> read_scene_file(const std::string& path, const ParameterChanges& changes = {});

/// The same for the text of a scene. @param name  stands for the file in messages
std::unique_ptr<Problem> read_scene_text(const std::string& text, const std::string& name,
                                         const ParameterChanges& changes = {});

}  // namespace ricochet
