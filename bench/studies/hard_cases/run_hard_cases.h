#pragma once

#include <string>
#include <vector>

#include "bench/metrics/metrics.h"
#include "bench/studies/hard_cases/hard_cases.h"
#include "bench/studies/hard_cases/hard_cell.h"

namespace ricochet {

/// Steps of a method relative to those of other methods, as in the conformance tests.
double step_factor(const std::string& method);

/// What runs of a case are held against.
struct CaseTruth {
  std::vector<TrueMotion> motions;  ///< of HardCase::true_motions
  ReferenceMotion motion;           ///< to the end of the only one of them
};

/// One method on one case, in a process of its own, which is killed after twice the time limit.
HardCell run_cell(const HardCase& hard_case, const Problem& problem, const CaseTruth& truth, const std::string& method,
                  double time_limit);

}  // namespace ricochet
