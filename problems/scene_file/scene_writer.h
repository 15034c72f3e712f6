#pragma once

#include <string>

#include "problems/problem.h"

/// @file
/// Writing of scene files: scene_text().

namespace ricochet {

/// Options of scene_text().
struct SceneTextOptions {
  bool with_normals = false;   ///< "Jn" of every contact, for readers that cannot differentiate
  bool with_set_state = true;  ///< the initial state that was set, not its formulas
  bool with_until = true;      ///< ProblemInfo::until, which readers that only integrate to T do not have
  bool with_title = true;      ///< id, title, source, hard feature and conventions
};

/// The problem as a scene file for read_scene_file(): formulas in terms of the parameters, with the values of these, the
/// initial state and the impact law of `problem`. `options` select fields. Equal problems give equal texts.
/// @throws InputError for a problem that is not made of formulas
std::string scene_text(const Problem& problem, const SceneTextOptions& options = {});

/// Writes scene_text() of `problem` to a new file at `path`.
/// @throws InputError when the file exists or cannot be written
void write_scene_file(const Problem& problem, const std::string& path);

}  // namespace ricochet
