#pragma once

#include <string>

#include "bench/studies/hard_cases/hard_cases.h"
#include "bench/studies/hard_cases/hard_cell.h"

namespace ricochet {

/// Steps of a method relative to those of other methods, as in the conformance tests.
double step_factor(const std::string& method);

/// One method on one case, in a process of its own, which is killed after twice the time limit.
/// @param motions  of HardCase::true_motions
HardCell run_cell(const HardCase& hard_case, const Problem& problem, const std::vector<TrueMotion>& motions,
                  const std::string& method, double time_limit);

}  // namespace ricochet
