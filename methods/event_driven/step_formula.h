#pragma once

#include <memory>
#include <variant>

#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_scheme.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/runge_kutta/embedded_tableau.h"

namespace ricochet {

/// Explicit steps of a pair (../modes/explicit_step.h), or implicit ones of Radau IIA (radau_step.h).
using StepFormula = std::variant<EmbeddedTableau, ButcherTableau>;

/// The largest StepEnds::degree() in a run with a formula, in which slip in space starts with the polynomial of explicit
/// steps.
int degree_between_ends(const StepFormula& formula);
/// @param formula  must outlive the step; if implicit, Radau IIA with an odd number of stages
std::unique_ptr<StepScheme> make_step(const StepFormula& formula, int n_q, ModeDynamics& dynamics);

}  // namespace ricochet
