#pragma once

#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/solution.h"
#include "reports/metrics.h"
#include "reports/setting.h"
#include "reports/timing.h"

namespace ricochet {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Counters, steps, elements, force_evaluations, jacobian_evaluations,
                                                mass_factorizations, matrix_factorizations, linear_solves,
                                                complementarity_solves, inner_iterations, pivots, events)

NLOHMANN_JSON_SERIALIZE_ENUM(FailureCode, {{FailureCode::not_stated, "not_stated"},
                                           {FailureCode::impacts_accumulate, "impacts_accumulate"},
                                           {FailureCode::painleve, "painleve"},
                                           {FailureCode::inconsistent, "inconsistent"},
                                           {FailureCode::indeterminate, "indeterminate"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(FailureReason, code, contacts)

/// The options of `ricochet run` that choose a problem: "--problem two_balls_spring --set height=100".
/// @param problem  id of a scene, or FILE.json or FILE.json#ID of a scene file
std::string problem_options(const std::string& problem, const std::map<std::string, double>& parameters);

/// One method on one problem with one setting, and what was measured: a row of the results of every study.
struct Run {
  static constexpr const char* kKind = "row";

  // The plan.
  std::string experiment;
  std::string problem;                       ///< id of a scene, or FILE.json or FILE.json#ID of a scene file
  std::map<std::string, double> parameters;  ///< of the problem that are changed
  std::string scene, group;                  ///< name of the problem with its parameters in tables, and of several such
  std::map<std::string, std::string> labels;  ///< further names, "family"
  std::map<std::string, double> conditions;   ///< of the experiment, "e" or "closed"
  std::string method;                         ///< as on the command line
  Setting setting;
  std::vector<std::string> sensitivities;  ///< variables by which the final state is differentiated; `error` is theirs
  std::string options;                     ///< further options of `ricochet run`, "--time-limit 60"
  std::string instead_of;                  ///< method whose failure with this setting this run answers; empty otherwise
  std::string expected;                    ///< why a failure is expected; empty: a failure is unexpected

  // The result.
  std::string title;  ///< of the method
  double nominal_order = 0;
  std::string status;    ///< to_string(Status), "not_built", "declined" or "not_run"
  std::string message;   ///< reason of a failure
  FailureReason reason;  ///< the same as data; not stated in rows of older files
  double h_bar = 0;      ///< mean length of a Runge-Kutta step, T / elements [s]
  /// Max-norm of the error of the final (q, v), or of its derivatives (reference::sensitivity_difference). NaN of a failed
  /// run, and without a reference.
  double error = std::numeric_limits<double>::quiet_NaN();
  double reference_error = 0;  ///< bound for the error of the reference
  double solution_size = 0;    ///< max-norm of the reference's final (q, v); 1 for derivatives
  double max_residual = -1;    ///< of the audit; -1: not audited
  int detected_events = 0;
  Counters counters;
  Metrics metrics;
  std::map<std::string, double> values;  ///< further results by name; NaN where a result does not exist
  Timing timing;                         ///< CPU time; no repetitions: not measured
  double peak_bytes = Metrics::kNone;    ///< of the heap, above what was allocated before; NaN in another process

  bool succeeded() const { return status == "success"; }
  /// Whether it failed after it began. A method that is not built, or declines the problem, does not begin.
  bool failed() const;
  bool has_error() const;  ///< succeeded, and was compared with a reference
  bool has_time() const { return timing.repetitions > 0; }
  /// A result by its name; NaN where it is missing.
  double value(const std::string& name) const;
  /// @throws std::out_of_range for one that the study does not state
  double condition(const std::string& name) const { return conditions.at(name); }
  const std::string& label(const std::string& name) const { return labels.at(name); }
  /// The command that repeats the run; empty without a problem that a command can choose.
  std::string command() const;
};
void to_json(nlohmann::json& j, const Run& run);
/// Fields that are missing have the value of a new Run.
void from_json(const nlohmann::json& j, Run& run);

/// Runs of one method without replacements, from coarse to fine settings.
std::vector<const Run*> runs_of(const std::vector<Run>& runs, const std::string& method);

}  // namespace ricochet
