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

/// Parameters that differ from the scene's defaults, by name.
using ParameterChanges = std::map<std::string, double>;

/// A scene in the list of all: what it is, and how it is made.
struct SceneEntry {
  std::string id;            ///< lower_snake, "bouncing_ball"
  std::string title;         ///< a line that says what it is
  std::string source;        ///< publication, or where the equations come from
  std::string hard_feature;  ///< what makes it hard for methods
  /// Makes it with changed parameters, not validated; throws InputError for names that it does not have.
  std::function<std::unique_ptr<Problem>(const ParameterChanges&)> make;
  std::vector<ParameterInfo> parameters{};  ///< of an assembled scene, whose problem does not know them
  std::string file{};                       ///< that states it, as the compiler was given it: set by register_scene()
  std::string solution{};                   ///< how its solution is known, for a scene with a certified one
};

/// Puts `entry` into the list; called by register_scene() in each scene's own file; no list of scenes exists anywhere
/// else. Throws std::logic_error for an id that is there.
/// @returns true, so that a constant of a file can be initialised by it
bool add_scene(SceneEntry entry);

/// Adds scenes that are read from data, when the list is first used. Throws as add_scene() does, then.
/// @returns true, so that a constant of a file can be initialised by it
bool add_scenes(std::function<std::vector<SceneEntry>()> read);

/// All compiled scenes, by id.
std::vector<SceneEntry> scenes();

/// The parameters of a `scene`, with defaults and units.
std::vector<ParameterInfo> parameters_of(const SceneEntry& scene);

/// The scene `id` with the parameters of `changes` in place of its own, validated.
/// @throws InputError for an unknown id (with the nearest known ones), an unknown parameter or a bad value
std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes = {});

}  // namespace ricochet
