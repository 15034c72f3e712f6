#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"
#include "reference/agreement.h"
#include "reference/ground_truth.h"

namespace ricochet {

/// The problem of a run, and the reference of its solution.
struct ProblemChoice {
  std::string problem;  ///< scene id, or "FILE#ID" of a scene file
  ParameterChanges parameters = {};
  bool is_changed = false;  ///< beyond its parameters, so that no known solution belongs to it

  bool is_scene_file() const { return problem.find(".json") != std::string::npos; }
  std::unique_ptr<Problem> make_problem() const;
  /// The solution that is known to many digits, if there is one (reference/truths.h).
  std::optional<reference::GroundTruth> truth() const;
  /// Reference of the final state: the known solution, else reference::truth_of() (reference/proven.h).
  /// @param sensitivities  derivatives that it must contain  @throws InputError if a known solution lacks one
  /// @throws std::logic_error if they are required of a computed reference
  reference::Reference make_reference(const Problem& problem, const std::vector<std::string>& sensitivities = {}) const;
};

/// Reads the fields "problem" and "parameters". @throws nlohmann::json::exception for a missing problem
ProblemChoice read_problem_choice(const nlohmann::json& experiment);

}  // namespace ricochet
