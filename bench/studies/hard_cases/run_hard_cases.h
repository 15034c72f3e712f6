#pragma once

#include <string>
#include <vector>

#include "bench/measure/metrics/metrics.h"
#include "bench/studies/hard_cases/hard_cases.h"
#include "bench/studies/hard_cases/hard_cell.h"

namespace ricochet {

/// Steps of a method relative to those of other methods, as in the conformance tests.
double step_factor(const std::string& method);

/// One method on one case, in a process of its own, which is killed after twice the time limit.
/// @param motions  of HardCase::true_motions
HardCell run_cell(const HardCase& hard_case, const Problem& problem, const std::vector<TrueMotion>& motions,
                  const std::string& method, double time_limit);

/// Adds its metrics to a cell that is a success, and the memory that a run takes where this program counts it; runs it anew
/// for that, in a process of its own, so that the verdict is that of run_cell().
/// @param reference  of the only true motion of the case
void look_at(const Problem& problem, const ReferenceMotion& reference, bool with_memory, double time_limit,
             HardCell& cell);

}  // namespace ricochet
