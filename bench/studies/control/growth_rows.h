#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/control/goals.h"
#include "reports/growth.h"
#include "reports/table.h"

namespace ricochet {

/// Work of one optimal control solve, and of a second one after the plant has run an interval and was moved.
struct ControlGrowth {
  static constexpr const char* kKind = "control_growth";

  /// One relaxation of the homotopy.
  struct Step {
    double sigma = 0;
    int iterations = 0;
    double seconds = 0;
    double complementarity = 0;  ///< max over the pairs of min(G, H)
    bool is_solved = false;
  };

  std::string problem;
  std::string method = "homotopy";  ///< or "shooting"
  std::string command;              ///< reproduces the run
  int intervals = 0, variables = 0, pairs = 0;
  std::string status, message;
  int iterations = 0;
  double seconds = 0;             ///< homotopy and crossover, without those for the guess
  double derivative_seconds = 0;  ///< of these, in gradients, Jacobians and Hessians
  std::vector<Step> steps;

  // Results of a solved run.
  double cost = 0;
  std::string again_status;        ///< of the second solve; why the plant did not come to it
  bool again_kept_branch = false;  ///< of a homotopy
  int again_iterations = 0;
  double again_seconds = 0;

  bool succeeded() const { return status == "success"; }
  bool is_solved_again() const { return again_status == "success"; }
  /// Whether the second solve was as short as it can be.
  bool is_short_again() const { return is_solved_again() && (again_kept_branch || method != "homotopy"); }
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlGrowth::Step, sigma, iterations, seconds, complementarity,
                                                is_solved)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlGrowth, problem, method, command, intervals, variables, pairs,
                                                status, message, iterations, seconds, derivative_seconds, steps, cost,
                                                again_status, again_kept_branch, again_iterations, again_seconds)

/// One line per run; below those of a problem, exponents in N of what was solved.
Table growth_table(const std::vector<ControlGrowth>& runs);
/// Per problem and for both methods: what is solved, exponents of time and iterations, cost on many intervals.
std::vector<Comparison> growth_comparisons(const std::vector<ControlGrowth>& runs);
/// Seconds over the number of intervals, a curve per problem and method.
std::vector<GrowthCurve> growth_curves(const std::vector<ControlGrowth>& runs);
/// One line per relaxation.
Table homotopy_steps(const std::vector<ControlGrowth>& runs);

}  // namespace ricochet
