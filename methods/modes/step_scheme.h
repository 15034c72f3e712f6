#pragma once

#include "methods/modes/event_functions.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_ends.h"

namespace ricochet {

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
  /// Velocities and accelerations at the stages of the last step, n_q x stages. Of explicit steps.
  virtual void copy_stages(Matrix& /*v*/, Matrix& /*a*/) const {}

  StepEnds ends;
  int order = 0;           ///< of the step
  int error_order = 0;     ///< the estimate is O(h^(error_order + 1))
  double kept_growth = 1;  ///< up to which a longer step would cost more than it saves: the length is kept
};

}  // namespace ricochet
