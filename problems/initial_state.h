#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

// A scene of measured data may start in penetration, or with joints that are not exactly closed. These functions accept
// it; methods/initial_state.h corrects the state.

/// As validate(), but contacts may penetrate at q0 by up to `depth` [m]. Bilateral constraints may be violated by the
/// same distance and, if depth > 0, by any velocity. @throws InputError
void validate(const Problem& problem, double depth);

/// As in registry.h and scene_file.h, with this validation. @throws InputError
std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes, double depth);
std::unique_ptr<Problem> read_scene_file(const std::string& path, const ParameterChanges& changes, double depth);

/// A copy of the problem with another initial state, which replaces the formulas of the parameters.
/// @throws InputError for a state that validate() rejects, or a problem that is not made of formulas
std::unique_ptr<Problem> with_initial_state(const Problem& problem, const Vector& q0, const Vector& v0);

}  // namespace ricochet
