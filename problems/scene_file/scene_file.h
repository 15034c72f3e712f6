#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"

/// @file
/// Scenes from JSON files: read_scene_file().

namespace ricochet {

/// Reads a scene from a JSON file, without a compiler. The file contains the scene itself, or an object with the scene
/// as "problem", or a list of such objects as "cases", from which `FILE#id` selects one. A scene has the fields
///
///     q0, v0, T, M, f                                  the equations of motion, required
///     geometry                                         M, f, gaps and tangents follow from it if not stated
///     params, units, Bu, u, contacts, friction, until, potential_energy, id, title, source, hard_feature
///
/// They are described by scene.schema.json in this folder, and by README.md, which is generated from it. Unknown fields
/// are rejected.
///
/// The name t is the time [s]. Expressions are in Python's syntax (parse_expression). Numbers may also be written as
/// JSON numbers.
/// @param path     path of the file, optionally with `#id`
/// @param changes  changed parameters of the scene
/// @throws InputError that names the file, the field and the position
std::unique_ptr<Problem> read_scene_file(const std::string& path, const ParameterChanges& changes = {});

/// Reads a scene from `text`, with `changes`. Messages contain `name` instead of a file name.
/// @throws InputError as read_scene_file()
std::unique_ptr<Problem> read_scene_text(const std::string& text, const std::string& name,
                                         const ParameterChanges& changes = {});

/// The `problem` whose runs end where the `formula` of q, v, t and the parameters vanishes, ProblemInfo::until.
/// @throws InputError for a formula that cannot be read, or a problem that is not made of formulas
std::unique_ptr<Problem> with_until(const Problem& problem, const std::string& formula);

}  // namespace ricochet
