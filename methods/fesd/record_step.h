#pragma once

#include "methods/elements/fesd_step.h"
#include "methods/fesd/sensitivity.h"
#include "methods/method.h"

namespace ricochet {

/// Adds the events and, on Recording::grid, the grid points of a step. @param previous  the one before it, or null;
/// @param t  its start [s]; @param sensitivity  after the step, or null
void record_step(const Problem& problem, Recording recording, const FesdStep& step, const FesdStep* previous, double t,
                 const Sensitivity* sensitivity, Solution& solution);

}  // namespace ricochet
