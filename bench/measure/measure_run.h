#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bench/measure/metrics/metrics.h"
#include "bench/measure/problem_choice.h"
#include "bench/measure/timing.h"
#include "methods/method.h"
#include "reports/run.h"

/// @file
/// One measurement, for all studies. A study plans runs (reports/run.h), measure_run() fills in the result of each, and
/// time_runs() measures their CPU times together:
///
///   Run run = planned_run(choice, "fesd:gauss:4", {.steps = 100});
///   const Solution solution = measure_run({.problem = *problem, .reference = &reference}, run);

namespace ricochet {

/// Reason why this program was built without the method of a `spec`, "libode-dev not found"; empty if it contains the
/// method, or if the method is unknown.
std::string reason_not_built(const std::string& spec);

/// A setting of the kind that the method takes.
Setting setting_of(const Method& method, int steps, double tolerance);

/// Rejects a setting that the method does not read.
/// @param steps, tolerance  the fields or options that were given, for messages; empty: not given
/// @throws InputError for steps of an error-controlled method, or a tolerance of a fixed-step method
void require_kind_of_setting(const Method& method, const std::string& steps, const std::string& tolerance);

/// A run with problem, method and setting; a method that is not built has the status of its result, too.
Run planned_run(const ProblemChoice& choice, const std::string& method, const Setting& setting);

/// Problem, reference and extent of a measurement.
struct Measurement {
  const Problem& problem;
  const reference::Reference* reference = nullptr;  ///< null: the run has no error
  const ReferenceMotion* motion = nullptr;          ///< null: the run has no metrics
  Recording recording = Recording::events;
  double time_limit = 0;        ///< wall time [s]; 0: none
  int most_audited_steps = -1;  ///< longer runs are not audited; -1: none is
  /// Relative change of a variable for sensitivities by differences (solve_with_differences); 0: sensitivities by
  /// solve_with_sensitivities().
  double change = 0;

  Settings settings(const Run& run) const;
};

/// Solves, with the sensitivities of the run, and fills in its result. A run that is not built, or that its method
/// declines, has that status; its solution is infeasible.
/// @param method  of the run, by default made from its specification
/// @param kept    made by `method` for this problem, to be used again; null: a new one
/// @throws InputError for an unknown method
Solution measure_run(const Measurement& measurement, Run& run);
Solution measure_run(const Measurement& measurement, const Method& method, Run& run, Solver* kept = nullptr);

/// Measures a run in a process of its own, which is ended after `seconds` of wall time. Its status is then "killed"; it is
/// "crashed" if the process died, with the reason as its message.
/// @param measure  returns the measured run
Run measured_in_child(const Run& run, double seconds, const std::function<Run(const Run&)>& measure);

/// The same run to be timed again and again, without audit. The problem must outlive it.
/// @param kept     as measure_run()
/// @param seconds  time of the run so far; 0: unknown. A short run is tried twice more for a better first impression.
TimedRun timed_run(const Measurement& measurement, const Run& run, std::shared_ptr<Solver> kept = nullptr,
                   double seconds = 0);

}  // namespace ricochet
