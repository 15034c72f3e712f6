#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "methods/method.h"
#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/agreement.h"
#include "reports/metrics.h"

namespace ricochet {

/// Reference of a whole trajectory: an event-located run whose end agrees with the reference of the final state.
struct ReferenceMotion {
  std::optional<Solution> motion;
  std::string reason;  ///< why there is none, as after an accumulation of impacts

  const Solution* get() const { return motion ? &*motion : nullptr; }
};
ReferenceMotion reference_motion(const Problem& problem, const reference::Reference& reference);

/// A run with more steps is not looked at: recording its motion and measuring it takes minutes.
inline constexpr int kMostMeasuredSteps = 20000;

/// The metrics of a run with its motion (Recording::motion).
///
/// Integrals over the time are sums over the pieces of the motion, cut where the reference has an impact, by three Gauss
/// points; largest values are those at their ends and at these points; of a method that tells no motion, those at its
/// grid points, and there is no integral. Events are those of the same contact and kind that are nearest to each other in
/// time, seen from both sides; the others are missed or spurious. Residuals of the laws: law_residuals.h.
///
/// @param reference  null where there is none
Metrics measure_metrics(const Problem& problem, const Solution& solution, const Solution* reference);

/// The same of a run that is repeated with its motion, which says why where it cannot be had, or not against a reference
/// motion.
/// @param steps  that the run took, 0 where that is not known: above kMostMeasuredSteps it is not looked at
Metrics metrics_of_run(const Method& method, const Problem& problem, Settings settings, std::int64_t steps,
                       const ReferenceMotion& reference);

}  // namespace ricochet
