#pragma once

#include <optional>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/agreement.h"
#include "reports/metrics.h"

namespace ricochet {

/// What a motion is held against at all times: an event-located run whose end agrees with the reference of the end.
/// Empty where there is none, as behind an accumulation of impacts.
std::optional<Solution> reference_motion(const Problem& problem, const reference::Reference& reference);

/// Of a run with more steps studies do not ask for metrics: recording and looking at its motion takes minutes.
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

}  // namespace ricochet
