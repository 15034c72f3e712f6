#pragma once

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "methods/method.h"
#include "problems/problem.h"
#include "problems/registry.h"
#include "reference/agreement.h"

namespace ricochet {

/// What to run: a problem, its reference, and methods with their grids of settings. Read from a file in
/// bench/experiments/, so that an experiment is data.
struct Experiment {
  struct MethodGrid {
    std::string method;
    std::vector<int> steps;          ///< fixed-step methods
    std::vector<double> tolerances;  ///< error-controlled methods
    std::string on_failure;          ///< method to run at the settings where this one fails; empty for none
    std::string not_built;           ///< why this program does not have the method; empty when it does
  };

  std::string id, title, description;
  std::string problem;  ///< scene id, or "FILE#ID" of a scene file
  ParameterChanges parameters;
  std::string ground_truth_file, ground_truth_case;  ///< empty: the reference is computed with SUNDIALS
  bool needs_reference = true;                       ///< false for experiments that measure time only
  std::vector<std::string> sensitivities;  ///< Settings::sensitivities, whose error is measured instead of the state's
  std::vector<MethodGrid> methods;
  std::string trajectory_method;  ///< run once with all grid points recorded; empty for none
  int trajectory_steps = 0;
  std::map<std::string, std::string> overhead_of;  ///< method -> method its cost is compared with
  std::string text;                                ///< of the file

  std::unique_ptr<Problem> make_problem() const;
  reference::Reference make_reference(const Problem& problem) const;
};

/// @param name  of a file in bench/experiments/ without ".json", or a path
/// @throws InputError with file and field
Experiment read_experiment(const std::string& name);

/// What a file in bench/experiments/ is about: one experiment, or several that it names as "parts".
struct ExperimentOutline {
  std::string title;
  std::vector<std::string> parts;  ///< experiments to read; the name itself when the file is one
};
ExperimentOutline outline_of(const std::string& name);

/// Path and text of a file in bench/experiments/, by its name without ".json", or a path. @throws InputError
std::pair<std::string, std::string> read_experiment_text(const std::string& name);

/// Names of the files in bench/experiments/.
std::vector<std::string> experiment_names();

/// A file of the source tree, by its path there; as given when it exists.
std::string find_project_file(const std::string& path);

}  // namespace ricochet
