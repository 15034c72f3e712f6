#pragma once

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/results.h"
#include "reports/table.h"

/// @file
/// Two methods, or two linear solvers, of optimal control against each other, with the goals that an experiment states.

namespace ricochet {

inline constexpr const char *kHomotopy = "homotopy", *kShooting = "shooting";

/// A quantity of both sides on one problem, and the number that a goal limits.
struct Comparison {
  std::string problem, quantity;
  std::string first, second;  ///< its values as text; empty where a side has none
  /// The number that a goal limits: mostly the second value divided by the first. NaN if a side has none.
  double reached = std::numeric_limits<double>::quiet_NaN();
};

/// A comparison of numbers: what is reached in `quantity` of `problem` is the second divided by the first.
Comparison quotient(const std::string& problem, const std::string& quantity, double first, double second);

/// The two sides of a table of comparisons.
struct Sides {
  std::string title = "Shooting against the homotopy", first = kHomotopy, second = kShooting;
};

/// A member of "goals" of an experiment: {"problem", "quantity", "at_most" or "at_least"}.
struct ControlGoal {
  std::string problem, quantity;
  double at_most = std::numeric_limits<double>::quiet_NaN(), at_least = at_most;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlGoal, problem, quantity, at_most, at_least)

/// One line for each of `comparisons`, with the goal beside what is reached.
/// @param header  of the results, with the "goals"
Table comparison_table(const std::vector<Comparison>& comparisons, const nlohmann::json& header,
                       const Sides& sides = {});

/// Field of the experiments.
inline constexpr const char* kGoalsField =
    R"~("goals": {"type": "array", "description": "What the second side of a table of comparisons is to reach: shooting, or ldl against mumps.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "quantity"], "properties": {
        "problem": {"type": "string", "description": "A problem of `ricochet control`.", "examples": ["two_carts"]},
        "quantity": {"type": "string", "description": "A line of the table.", "examples": ["median cost"]},
        "at_most": {"type": "number", "description": "Largest value, mostly of the second side divided by the first.", "examples": [0.1]},
        "at_least": {"type": "number", "description": "Least value.", "examples": [50]}}}})~";

}  // namespace ricochet
