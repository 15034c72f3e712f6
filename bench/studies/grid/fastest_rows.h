#pragma once

#include <string>
#include <vector>

#include "bench/measure/metrics/metric_tables.h"
#include "reports/run.h"
#include "reports/table.h"

namespace ricochet {

/// The fastest run of a family of methods on a scene whose error is at most a level; its status is "not_reached" where
/// no run of the family has such an error.
struct FastestRun : Run {
  const std::string& family() const { return label("family"); }
  const std::string& solver() const { return label("solver"); }  ///< "new" for each run, or "kept" (Method::prepare)
  double level() const { return condition("level"); }            ///< error to be reached
  double microseconds() const { return 1e6 * timing.median; }    ///< CPU time of the whole run

  bool is_reached() const { return has_time(); }
  /// Whether the reference is accurate enough for the level.
  bool is_judged() const { return level() > reference_error; }
};

/// The runs with this solver, for the tables below.
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
