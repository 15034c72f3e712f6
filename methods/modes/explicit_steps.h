#pragma once

#include <memory>

#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_scheme.h"
#include "methods/runge_kutta/embedded_tableau.h"

namespace ricochet {

/// The steps of a pair: compiled for its coefficients where they are known (explicit_coefficients.h), else by loops.
std::unique_ptr<StepScheme> make_explicit_step(const EmbeddedTableau& tableau, int n_q, ModeDynamics& dynamics);

}  // namespace ricochet
