#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "methods/method.h"
#include "problems/problem.h"
#include "problems/registry.h"
#include "reference/proven.h"
#include "reports/verdict.h"

namespace ricochet {

/// A final state that a hard case may end in.
struct TrueMotion {
  Vector q, v;
  double uncertainty = 0;  ///< of a computed one, max-norm; 0 for a closed form

  /// Max-norm of the difference of (q, v).
  double error_of(const Solution& solution) const;
  /// The same for what compares with references; it has an end, and no motion.
  reference::Reference reference() const;
};

/// A problem that methods stumble over, what is known of its solution, and what a run must keep.
struct HardCase {
  std::string id, title, group;
  std::string problem;  ///< scene id
  ParameterChanges parameters;
  CaseLimits limits;
  int first_order_steps = 0, high_order_steps = 0;  ///< of fixed-step methods, by their order through impacts
  double tolerance = 0;                             ///< of error-controlled ones
  nlohmann::json motions;                           ///< of the file

  std::unique_ptr<Problem> make_problem() const;
  /// @throws InputError for a formula that is wrong, std::runtime_error when a reference has no solution, or is not ten
  /// times as accurate as the case's limit
  std::vector<TrueMotion> true_motions(const Problem& problem) const;
};

/// The file of the hard cases, bench/experiments/hard_cases.json:
///
///   "time_limit"   of a cell, wall time [s]; a cell that does not answer in twice that time is killed
///   "times"        false: results do not depend on how fast the machine is, but for runs that end near the limit
///   "also"         methods beside the registered ones' examples
///   "only_case", "only_method"  one or a list of cases, of methods, also one that is not in the matrix
///   "defaults"     "steps": {"first_order", "high_order"}, "tolerance", "limits", for cases that state no others.
///                  Methods that take fewer or more steps in the conformance tests do so here, in proportion.
///   "cases"        each with "id", "group", "title", "problem", "parameters", and
///     "motions"    final states, one of which is right: {"q", "v"} with formulas in the parameters, or {"reference":
///                  {...}}, computed with event location for the problem with these parameters changed, too
///     "limits"     of CaseLimits, by name: {"limit", "reason"}
///     "paradox"    contact without a unique force
///     "conserves_energy"  true: a loss is a violation, too
struct HardCases {
  std::string id;
  double time_limit = 0;
  bool with_times = true;  ///< false: no cell says a wall time, how far its run came until the limit, or its memory
  std::vector<HardCase> cases;
  std::vector<std::string> methods;  ///< examples of the registered ones, and "also"
};

/// @param experiment  the file, as a command line may have changed it
/// @throws InputError with the field; nlohmann::json::exception for one that is missing
HardCases read_hard_cases(const nlohmann::json& experiment);

}  // namespace ricochet
