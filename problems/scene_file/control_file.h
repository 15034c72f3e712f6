#pragma once

#include <memory>
#include <string>

#include "problems/control/optimal_control_problem.h"
#include "problems/registry.h"

/// @file
/// Optimal control problems as files: a scene file (scene_file.h) whose scene has a block "control".

namespace ricochet {

/// Reads an optimal control problem from a JSON file, without a compiler. The plant is the scene of the file, the block
/// "control" states costs, bounds, constraints, the number of intervals and the first guess of the controls. The fields
/// are described by scene.schema.json in this folder, and by README.md, which is generated from it.
/// @param path     path of the file, optionally with `#id`
/// @param changes  changed parameters of the scene
/// @throws InputError that names the file, the field and the position; for a scene without "control"; for a plant that
/// optimal control does not take: with "until", an impact law other than newton, or e as a formula of vn
std::unique_ptr<OptimalControlProblem> read_control_file(const std::string& path, const ParameterChanges& changes = {});

/// Reads an optimal control problem from `text`, with `changes`. Messages contain `name` instead of a file name.
/// @throws InputError as read_control_file()
std::unique_ptr<OptimalControlProblem> read_control_text(const std::string& text, const std::string& name,
                                                         const ParameterChanges& changes = {});

/// Whether the scene of this `path`, optionally with `#id`, has a block "control". @throws InputError as read_scene_file()
bool is_control_file(const std::string& path);

/// The `problem` as a file for read_control_file(): its plant as scene_text(), costs and constraints as formulas of the
/// parameters, bounds as numbers. A contact whose gap is another function than the distance of its shapes, such as its
/// square, is written without these. Equal problems give equal texts.
/// @throws InputError for a plant that is not made of formulas
std::string control_text(const OptimalControlProblem& problem);

}  // namespace ricochet
