#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

// A scene of measured data may start in penetration, or with joints that are not quite closed: read so far, for
// methods/initial_state.h to mend.

/// validate(), but for gaps: at q0 contacts may penetrate, and bilateral constraints be violated, by `depth` [m]; the
/// latter by any velocity, too, when depth > 0. @throws InputError
void validate(const Problem& problem, double depth);

/// The functions of registry.h and scene_file.h with this validation. @throws InputError
std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes, double depth);
std::unique_ptr<Problem> read_scene_file(const std::string& path, const ParameterChanges& changes, double depth);

/// The problem with another state at t = 0, whatever its parameters are.
/// @throws InputError for a state that validate() rejects, or a problem that is not made of formulas
std::unique_ptr<Problem> with_initial_state(const Problem& problem, const Vector& q0, const Vector& v0);

}  // namespace ricochet
