#pragma once

#include "reports/record.h"
#include "reports/table.h"

namespace ricochet {

/// One line per method: nominal and fitted order with its interval and window, cost per step, residual, runs.
Table order_summary(const Results& results);

/// Every run: error, local slope, microseconds per step, counters, residual, or the reason of its failure.
Table order_details(const Results& results);

/// Runs without a solution, with the reason, the answer to it if there was one, and the command that repeats the run.
Table failures(const Results& results);

/// Shortest time in which each method reached an error level, and its ratio to the fastest.
Table time_to_reach(const Results& results, const std::vector<double>& levels = {1e-3, 1e-6, 1e-9});

/// Time of each method over that of the method it is compared with (header "overhead_of") at the same number of
/// elements.
Table overhead(const Results& results);

/// Every run with its time, for the work-precision diagram.
Table precision_details(const Results& results);

}  // namespace ricochet
