#pragma once

#include <string>

#include "problems/problem.h"

/// @file
/// Scenes to JSON files: scene_text().

namespace ricochet {

/// What scene_text() writes beside the formulas that every reader needs.
struct SceneTextOptions {
  bool with_normals = false;  ///< "Jn" of every contact, for readers that cannot differentiate
};

/// The problem as a scene file that read_scene_file() reads: formulas in terms of its parameters, whose values are
/// those of `problem`. Equal problems give equal texts. `options` say what is added.
/// @throws InputError for a problem that is not made of formulas
std::string scene_text(const Problem& problem, const SceneTextOptions& options = {});

/// scene_text() of `problem` in a new file at `path`.
/// @throws InputError when the file exists or cannot be written
void write_scene_file(const Problem& problem, const std::string& path);

}  // namespace ricochet
