#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/measure/problem_choice.h"

namespace ricochet {

/// An experiment of kind "method_grid": methods with a grid of settings on one problem.
///
///   "problem", "parameters"   problem_choice.h
///   "reference"       null: no reference, for times only
///   "sensitivities"   whose error is measured instead of the state's, against a ground truth
///   "grids"           {name: numbers of steps}, or {"from", "to", "per_decade"} for a logarithmic one, or names of
///                     other grids, or a list of all that
///   "methods"         [{"method", "steps" or "tolerances", "on_failure": method that is run where this one fails,
///                     "may_fail": why a failure is no surprise}]
///   "trajectory"      {"method", "steps"} of a run with all grid points, for a figure
///   "overhead_of"     {method: method its cost is compared with}
///   "times"           false: times are not measured
///   "metrics"         false: only the errors at the end
struct GridExperiment {
  struct MethodGrid {
    std::string method;
    std::vector<int> steps;          ///< fixed-step methods
    std::vector<double> tolerances;  ///< error-controlled methods
    std::string on_failure;          ///< empty for none
    std::string may_fail;            ///< empty: a failure is unexpected
  };

  std::string id;
  ProblemChoice problem;
  bool needs_reference = true;
  std::vector<std::string> sensitivities;  ///< Settings::sensitivities
  std::vector<MethodGrid> methods;
  std::string trajectory_method;  ///< empty for none
  int trajectory_steps = 0;
  std::map<std::string, std::string> overhead_of;
  bool with_times = true, quick = false;
  bool with_metrics = true;  ///< there are none of sensitivities
  double time_limit = 60;    ///< of a run, wall time [s]
};

/// @throws InputError with the field; nlohmann::json::exception for one that is missing
GridExperiment read_grid_experiment(const nlohmann::json& experiment);

}  // namespace ricochet
