#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"
#include "reference/agreement.h"

namespace ricochet {

/// The problem of an experiment file, and what its solution is compared with.
struct ProblemChoice {
  std::string problem;  ///< scene id, or "FILE#ID" of a scene file
  ParameterChanges parameters;
  std::string ground_truth_file = {}, ground_truth_case = {};  ///< empty: the reference is computed with SUNDIALS

  bool is_scene_file() const { return problem.find(".json") != std::string::npos; }
  std::unique_ptr<Problem> make_problem() const;
  /// @param sensitivities  that it is to have, too; only of a ground truth
  reference::Reference make_reference(const Problem& problem, const std::vector<std::string>& sensitivities = {}) const;
  /// "--problem two_balls_spring --set height=100", of `ricochet run`.
  std::string arguments() const;
};

/// The command that repeats a run, with all digits of its setting.
/// @param scene  ProblemChoice::arguments(), or others of `ricochet run` @param steps  0 for a method with a tolerance
std::string run_command(const std::string& scene, const std::string& method, int steps, double tolerance);

/// A setting in a table: "-N 50", or "--tolerance 1e-06" where there are no steps.
std::string setting_text(int steps, double tolerance);

/// Of the fields "problem", "parameters" and "reference": {"ground_truth": file, "case": id}.
/// @throws nlohmann::json::exception for one that is missing
ProblemChoice read_problem_choice(const nlohmann::json& experiment);

}  // namespace ricochet
