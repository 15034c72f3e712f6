#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "problems/input_error.h"
#include "problems/problem.h"

namespace ricochet {

/// Parameters that differ from the scene's defaults, by name.
using ParameterChanges = std::map<std::string, double>;

struct SceneEntry {
  std::string id, title, source, hard_feature;
  std::function<std::unique_ptr<Problem>(const ParameterChanges&)> make;
  std::vector<ParameterInfo> parameters{};  ///< of an assembled scene, whose problem does not know them
};

/// Called by register_scene() in each scene's own file; no list of scenes exists anywhere else.
bool add_scene(SceneEntry entry);

/// All compiled scenes, by id.
std::vector<SceneEntry> scenes();

/// What a scene takes, with defaults and units.
std::vector<ParameterInfo> parameters_of(const SceneEntry& scene);

/// The scene `id` with changed parameters, validated.
/// @throws InputError for an unknown id (with the nearest known ones), an unknown parameter or a bad value
std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes = {});

}  // namespace ricochet
