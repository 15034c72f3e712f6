#pragma once

#include <string>

#include "bench/studies/hard_cases.h"
#include "reports/hard_cases.h"

namespace ricochet {

/// One method on one case, in a process of its own, which is killed after twice the time limit.
/// @param motions  of HardCase::true_motions
HardCell run_cell(const HardCase& hard_case, const Problem& problem, const std::vector<TrueMotion>& motions,
                  const std::string& method, double time_limit);

struct HardCaseOptions {
  std::string folder = "out/results";
  std::string command_line;  ///< for the header
};

/// Runs every method on every case and returns the path of the results file. Cells of the same file by the same program
/// are taken as they are; an interrupted run is continued.
std::string run_hard_cases(const HardCases& cases, const HardCaseOptions& options);

}  // namespace ricochet
