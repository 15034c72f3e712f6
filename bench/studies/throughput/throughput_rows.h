#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

/// One setting of a method on the first runs of an ensemble.
struct ThroughputSetting {
  int steps = 0;
  double tolerance = 0;
  double error = 0;   ///< that nine of ten runs keep, of the final (q, v), max-norm; NaN: more than one in ten fails
  double failed = 0;  ///< part of the runs
  double microseconds = 0;  ///< CPU time of a run in one thread

  std::string text() const;  ///< "-N 50", "--tolerance 1e-06"
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ThroughputSetting, steps, tolerance, error, failed, microseconds)

/// A method on an ensemble: error and cost of its settings, from cheap to costly.
struct ThroughputCurve {
  static constexpr const char* kKind = "throughput_curve";

  std::string scene, method;
  double uncertainty = 0;        ///< of the reference, which nine of ten runs keep
  int judged = 0;                ///< runs that both references finish; the others are not counted
  double make_microseconds = 0;  ///< CPU time of making the problem
  double set_microseconds = 0;   ///< CPU time of setting the values of a run in it
  std::vector<ThroughputSetting> settings;
  std::string why;  ///< of the last failure; or why the method declines
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ThroughputCurve, scene, method, uncertainty, judged, make_microseconds,
                                                set_microseconds, settings, why)

/// The cheapest setting that reaches an error, by a number of threads, and by as many processes that share nothing.
struct ThroughputRun {
  static constexpr const char* kKind = "throughput_run";

  std::string scene, method;
  double level = 0;
  ThroughputSetting setting;
  bool is_reached = false;
  std::string command;
  int threads = 1;
  double runs = 0;             ///< of the ensemble
  double seconds = 0;          ///< wall time, the least; lines of CSV included, making the problems not
  double cpu_seconds = 0;      ///< of all threads, median
  double process_seconds = 0;  ///< the same of the processes
  double process_cpu_seconds = 0;

  double rate() const { return runs / seconds; }                  ///< runs per second
  double process_rate() const { return runs / process_seconds; }  ///< the machine's limit
  double core_rate() const { return runs / cpu_seconds; }         ///< runs per second of a core
  double process_core_rate() const { return runs / process_cpu_seconds; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ThroughputRun, scene, method, level, setting, is_reached, command,
                                                threads, runs, seconds, cpu_seconds, process_seconds,
                                                process_cpu_seconds)

/// A line per scene and error, a column per method: runs per second of CPU time by one thread, by all, and by as many
/// processes.
Table throughput_summary(const std::vector<ThroughputRun>& runs);
/// Runs per second by every number of threads, per core, beside what processes reach.
Table throughput_table(const std::vector<ThroughputRun>& runs);
/// Every setting that was tried.
Table throughput_settings_table(const std::vector<ThroughputCurve>& curves);
/// Cost of a run before its first step: building the problem and setting its values.
Table throughput_setup_table(const std::vector<ThroughputCurve>& curves);
/// Errors that a method does not reach, with the reason.
Table throughput_failures(const std::vector<ThroughputRun>& runs, const std::vector<ThroughputCurve>& curves);

/// Runs per second of a core over the error, a panel per scene; and over the number of threads, with the processes.
std::vector<Chart> throughput_charts(const std::vector<ThroughputCurve>& curves, const std::vector<ThroughputRun>& runs,
                                     const std::string& name);

}  // namespace ricochet
