#pragma once

#include <string>
#include <vector>

#include "bench/experiment/experiment_file.h"

namespace ricochet {

/// A study of kind "method_grid" that is defined by the command line instead of a file.
struct AdHocStudy {
  std::string problem;               ///< "NAME,PARAMETER=VALUE,..."
  std::string scene;                 ///< the same with a scene file instead of a name
  std::vector<std::string> methods;  ///< empty: one of each family
  /// Settings: "10..1000" for a logarithmic grid, "10..1000:4" with 4 values per decade, or "10,20,50". Default:
  /// 10..1000, 100 times as many for first-order methods, and 1e-3..1e-9.
  std::string steps, tolerances;
};

/// The experiment as a file. Its id contains problem and methods.
/// @throws InputError for an empty or missing option
ExperimentFile ad_hoc_experiment(const AdHocStudy& study);

}  // namespace ricochet
