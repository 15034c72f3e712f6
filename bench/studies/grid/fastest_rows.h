#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/measure/metrics/metric_tables.h"
#include "reports/metrics.h"
#include "reports/results.h"
#include "reports/table.h"

namespace ricochet {

/// The fastest run of a family of methods on a scene whose error is at most a level.
struct FastestRun {
  static constexpr const char* kKind = "fastest_run";

  std::string scene, group, family;
  std::string problem;         ///< of the scene, as `ricochet run` is told: an id, or "FILE#ID"
  std::string solver = "new";  ///< made for each run, or "kept" between runs (Method::prepare)
  double level = 0;
  double uncertainty = 0;  ///< of the reference; a level that is not above it cannot be judged
  std::string method, setting, command;
  double error = 0;          ///< of the final (q, v), max-norm
  double microseconds = -1;  ///< CPU time of the whole run, median; -1: no run reaches the level
  double lower_quartile = -1, upper_quartile = -1;
  double solution_size = 0;            ///< max-norm of the reference's final (q, v)
  Metrics metrics;                     ///< of the whole motion of this run
  double peak_bytes = Metrics::kNone;  ///< of the heap, above what was taken before; none of a run in another process
  int tried = 0, failed = 0;           ///< runs of the family on this scene
  std::string why;                     ///< of the last failure

  bool is_reached() const { return microseconds > 0; }
  bool is_judged() const { return level > uncertainty; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(FastestRun, scene, group, family, problem, solver, level, uncertainty,
                                                method, setting, command, error, microseconds, lower_quartile,
                                                upper_quartile, solution_size, metrics, peak_bytes, tried, failed, why)

/// Those with this solver, for the tables below.
std::vector<FastestRun> runs_of_solver(const std::vector<FastestRun>& runs, const std::string& solver);

/// A line per scene, a column per level: microseconds of each family, and those of the second over those of the first.
Table fastest_table(const std::vector<FastestRun>& runs);
/// Geometric means of the time of every family over that of the first, by group and level, with the extremes.
Table ratio_table(const std::vector<FastestRun>& runs);
/// Which method and setting it was.
Table choice_table(const std::vector<FastestRun>& runs);
/// Levels that a family does not reach, and those that the reference cannot judge, with the reason.
Table unreached_table(const std::vector<FastestRun>& runs);

/// The runs of choice_table() whose motion was looked at, each once.
std::vector<MeasuredRun> measured_runs(const std::vector<FastestRun>& runs);

}  // namespace ricochet
