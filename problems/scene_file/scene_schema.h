#pragma once

#include "problems/json_schema.h"

namespace ricochet {

/// The schema problems/scene_file/scene.schema.json, which is compiled into the program. Scene files are checked with
/// it. Its parts are "scene", "labelled" (an object with the scene as "problem") and "set" (several of them).
const JsonSchema& scene_schema();

}  // namespace ricochet
