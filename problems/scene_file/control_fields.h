#pragma once

#include <filesystem>
#include <memory>

#include "problems/control/optimal_control_problem.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/scene_file/field.h"

namespace ricochet {

/// The optimal control problem of a scene file.
/// @param control   block "control" of a scene, which satisfies its schema
/// @param model     the scene; its control is the guess unless the block states one
/// @param in_state  names that formulas of q, v, t and the parameters may use, in the symbols of the `model`
/// @param folder    of the file, which other files are named from
/// @throws InputError that names the field; the result is not validated
std::unique_ptr<OptimalControlProblem> make_control_problem(const Field& control, SymbolicModel model,
                                                            const ExpressionNames& in_state,
                                                            const std::filesystem::path& folder);

}  // namespace ricochet
