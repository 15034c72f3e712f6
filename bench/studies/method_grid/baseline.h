#pragma once

#include <string>
#include <vector>

#include "bench/studies/method_grid/grid_results.h"

namespace ricochet {

/// What a baseline check found. Each finding names the line of the baseline: method, setting, then and now.
struct BaselineCheck {
  std::vector<std::string>
      regressions;  ///< an order or an accuracy got worse, a run fails that succeeded, a run is missing
  std::vector<std::string> improvements;  ///< worth a new baseline
  int compared = 0;
};

/// Rules. An order may be 0.1 lower than stored, a fraction of what the saw-tooth of impact errors lets a fit scatter.
/// An error may be 10 % larger, and by 1e-11 of the solution, where compilers and fused multiply-adds change the
/// rounding. An error-controlled method chooses its steps by decisions that a last bit can turn (its errors scattered
/// by up to 7 between processors), so its error may be 10 times larger. Of runs whose error is not asymptotic
/// (kAsymptoticError) only the success is held.
/// @throws InputError when the file cannot be read or belongs to another experiment
BaselineCheck check_baseline(const GridResults& results, const std::string& path);

/// Stores the orders and accuracies of `results` as a baseline. Refuses to replace an existing file.
void write_baseline(const GridResults& results, const std::string& path);

}  // namespace ricochet
