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

/// Adds metrics to a cell that is a success, and the memory that a run takes if this program counts it. The run is repeated
/// for that in a process of its own, so that the verdict remains that of run_cell().
/// @param reference  of the only true motion of the case
void add_metrics(const Problem& problem, const ReferenceMotion& reference, bool with_memory, double time_limit,
                 HardCell& cell);

}  // namespace ricochet
