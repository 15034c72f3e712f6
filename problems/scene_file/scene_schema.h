#pragma once

#include "problems/json_schema.h"

namespace ricochet {

/// problems/scene_file/scene.schema.json, which goes into the program: scene files are checked with it, so that it says
/// what they may hold. Its parts are "scene", "labelled", an object with the scene as "problem", and "set", several.
const JsonSchema& scene_schema();

}  // namespace ricochet
