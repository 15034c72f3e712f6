#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "problems/input_error.h"
#include "problems/problem.h"

/// @file
/// The list of all compiled scenes: make_problem().

namespace ricochet {

/// Parameters that differ from the defaults of the scene, by name.
using ParameterChanges = std::map<std::string, double>;

/// A scene in the list of all scenes: its description and a function that makes it.
struct SceneEntry {
  std::string id;            ///< lower_snake, "bouncing_ball"
  std::string title;         ///< short description
  std::string source;        ///< publication, or where the equations come from
  std::string hard_feature;  ///< what makes it hard for methods
  /// Makes the problem with changed parameters, not validated; throws InputError for unknown names.
  std::function<std::unique_ptr<Problem>(const ParameterChanges&)> make;
  std::vector<ParameterInfo> parameters{};  ///< of an assembled scene, whose problem does not list them
  std::string file{};                       ///< source file as the compiler saw it; set by register_scene()
  std::string solution{};                   ///< how its solution is known, for a scene with a certified one
};

/// Adds `entry` to the list. Called by register_scene() in the file of each scene; there is no other list of scenes.
/// Throws std::logic_error for an id that exists already.
/// @returns true, so that it can initialise a constant
bool add_scene(SceneEntry entry);

/// Adds scenes that are read from data at the first use of the list. Throws as add_scene() at that time.
/// @returns true, so that it can initialise a constant
bool add_scenes(std::function<std::vector<SceneEntry>()> read);

/// All compiled scenes, by id.
std::vector<SceneEntry> scenes();

/// The parameters of a `scene`, with defaults and units.
std::vector<ParameterInfo> parameters_of(const SceneEntry& scene);

/// The scene `id` with the parameters in `changes`, validated.
/// @throws InputError for an unknown id (with close matches), an unknown parameter or a bad value
std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes = {});

}  // namespace ricochet
