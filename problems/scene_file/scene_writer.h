#pragma once

#include <string>

#include "problems/problem.h"

namespace ricochet {

struct SceneTextOptions {
  bool with_normals = false;  ///< "Jn" of every contact, for readers that cannot differentiate
};

/// The problem as a scene file that read_scene_file() reads: formulas in terms of its parameters, whose values are
/// those of `problem`. Equal problems give equal texts.
/// @throws InputError for a problem that is not made of formulas
std::string scene_text(const Problem& problem, const SceneTextOptions& options = {});

/// scene_text() in a new file. @throws InputError when the file exists or cannot be written
void write_scene_file(const Problem& problem, const std::string& path);

}  // namespace ricochet
