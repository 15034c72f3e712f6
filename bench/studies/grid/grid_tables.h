#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/measure/metrics/metric_tables.h"
#include "bench/studies/grid/grid_results.h"
#include "reports/figures.h"
#include "reports/section.h"
#include "reports/table.h"

namespace ricochet {

/// One line per method: nominal and fitted order with its interval and window, cost per step, residual, runs.
Table order_summary(const GridResults& results);

/// Every run: error, local slope, microseconds per step, counters, residual, or the reason of its failure.
Table order_details(const GridResults& results);

/// Every run whose motion was looked at, for the tables of metric_tables.h.
std::vector<MeasuredRun> measured_runs(const GridResults& results);

/// Runs without a solution, with the reason, the answer to it if there was one, and the command that repeats the run.
Table failures(const GridResults& results);

/// Shortest time in which each method reached an error level, and its ratio to the fastest.
Table time_to_reach(const GridResults& results, const std::vector<double>& levels = {1e-3, 1e-6, 1e-9});

/// Time of each method over that of the method it is compared with ("overhead_of") at the same number of
/// elements.
Table overhead(const GridResults& results);

/// "METHOD: error 1.2e-03", of the run that answers the failure of `record`; nothing without one.
std::optional<std::string> replacement_of(const GridResults& results, const Run& record);

/// Anchor of a run in precision_details(). @param record  one of `results`
std::string row_id(const GridResults& results, const Run& record);

/// Every run with its time, for the work-precision diagram.
Table precision_details(const GridResults& results);

/// Error over step length, one panel per family of methods, with lines of the nominal order. Failed runs are crosses on
/// the upper frame, runs that replace them open circles.
Chart order_chart(const GridResults& results);

/// Positions and velocities over time; velocities jump.
Chart trajectory_chart(const Trajectory& trajectory, const std::string& file);

}  // namespace ricochet
