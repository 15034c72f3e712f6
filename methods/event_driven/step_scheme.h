#pragma once

#include <memory>
#include <variant>

#include "methods/event_driven/event_functions.h"
#include "methods/event_driven/mode_dynamics.h"
#include "methods/event_driven/step_ends.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/runge_kutta/embedded_tableau.h"

namespace ricochet {

/// Explicit steps of a pair (explicit_step.h), or implicit ones of Radau IIA (radau_step.h).
using StepFormula = std::variant<EmbeddedTableau, ButcherTableau>;

/// One step for q' = v, v' = a(q, v), with the modes of ModeDynamics and an estimate of its error.
class StepScheme {
 public:
  virtual ~StepScheme() = default;

  /// Starts a run: discards data of earlier steps. @param tolerance  of error(), for inner iterations
  virtual void start(double /*tolerance*/) {}
  /// Makes a step from the left end of `ends`; `watched`, unless null, records every stage. @return false if some
  /// acceleration does not exist, or an iteration does not converge
  virtual bool take(double h, EventFunctions* watched) = 0;
  /// Computes the acceleration at the right end.
  virtual bool finish() = 0;
  /// Error estimate of the last step: root mean square of its components relative to `tolerance` (1 + |x|).
  virtual double error(double tolerance) const = 0;

  StepEnds ends;
  int order = 0;           ///< of the step
  int error_order = 0;     ///< the estimate is O(h^(error_order + 1))
  double kept_growth = 1;  ///< up to which a longer step would cost more than it saves: the length is kept
};

/// The largest StepEnds::degree() in a run with a formula, in which slip in space starts with the polynomial of explicit
/// steps.
int degree_between_ends(const StepFormula& formula);
/// @param formula  must outlive the step; if implicit, Radau IIA with an odd number of stages
std::unique_ptr<StepScheme> make_step(const StepFormula& formula, int n_q, ModeDynamics& dynamics);

}  // namespace ricochet
