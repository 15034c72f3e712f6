#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/measure/measure_run.h"
#include "bench/studies/verify/check_row.h"
#include "methods/method.h"

namespace ricochet {

/// The method that is verified. Each check makes its own, in a process of its own.
struct Subject {
  std::string spec;
  MethodInfo info;
  double step_factor = 1;  ///< steps relative to those of other methods, as in the conformance tests
  double time_limit = 0;   ///< of a check, wall time [s]

  bool is_first_order() const { return !info.is_adaptive && info.order_impacts <= 1; }
  int steps(double usual) const;
  /// Setting of a check: steps by the order of the method, or a tolerance.
  Setting setting(int first_order_steps, int high_order_steps, double tolerance) const;
  /// The run of the method with a setting on a problem.
  Run planned(const ProblemChoice& choice, const Setting& setting) const { return planned_run(choice, spec, setting); }
};

/// A problem with what its solution is compared with; both are made when they are first asked for, and kept.
class KnownProblem {
 public:
  explicit KnownProblem(ProblemChoice choice, std::vector<std::string> sensitivities = {})
      : choice_(std::move(choice)), sensitivities_(std::move(sensitivities)) {}

  const ProblemChoice& choice() const { return choice_; }
  const std::vector<std::string>& sensitivities() const { return sensitivities_; }
  const Problem& problem() const;
  const reference::Reference& reference() const;

 private:
  ProblemChoice choice_;
  std::vector<std::string> sensitivities_;
  mutable std::unique_ptr<Problem> problem_;
  mutable std::optional<reference::Reference> reference_;
};

/// One check of the battery.
struct Check {
  std::string group, name;
  /// Makes what all methods share; in the process that starts the others.
  std::function<void()> prepare;
  /// Called in a process of its own. What it throws is a failure.
  std::function<CheckResult(const Subject& subject)> run;

  std::string full_name() const { return group + "/" + name; }
};

/// The check of one method. A process that dies, or has no answer in time, is a failure.
CheckRow run_check(const Check& check, const Subject& subject);

// The groups of the battery, each from its field of the experiment. @throws InputError with the field;
// nlohmann::json::exception for one that is missing

/// "orders": the order of fixed-step methods, the error over the tolerance of the others; of the state, or of
/// sensitivities.
void add_order_checks(const nlohmann::json& experiment, std::vector<Check>& battery);
/// "truth": error and impacts of problems whose solution is known to 42 digits.
void add_truth_checks(const nlohmann::json& experiment, std::vector<Check>& battery);
/// "promises": what every method owes on every scene. And bad input, and allocation.
void add_promise_checks(const nlohmann::json& experiment, std::vector<Check>& battery);
/// "hard_cases": the cells of the study of that name.
void add_hard_case_checks(const nlohmann::json& experiment, std::vector<Check>& battery);
/// "public_reports": scenes made from public reports, each with its right answer.
void add_public_report_checks(const nlohmann::json& experiment, std::vector<Check>& battery);

}  // namespace ricochet
