#pragma once

#include "methods/fesd/pivoting_solver.h"
#include "methods/fesd/sensitivity.h"
#include "methods/method.h"

namespace ricochet {

/// Adds the events and, on Recording::grid, the grid points of the step that `solver` has just solved. @param t  its
/// start [s]; @param sensitivity  behind that step, or null
void record_step(const Problem& problem, Recording recording, const PivotingSolver& solver, double t,
                 const Sensitivity* sensitivity, Solution& solution);

}  // namespace ricochet
