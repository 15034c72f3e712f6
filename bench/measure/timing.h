#pragma once

#include <functional>
#include <string>
#include <vector>

#include "problems/solution.h"
#include "reports/timing.h"

namespace ricochet {

/// A run to be timed.
struct TimedRun {
  std::string name;
  double expected_seconds = 0;  ///< from an earlier, single measurement; decides the number of repetitions
  std::function<double()> run;  ///< returns the time that it took by itself [s]: Solution::own_seconds, or 0
};

/// Wall time of a run, or what it says itself where it was in another process [s]. @param solution  out
double seconds_of(const std::function<Solution()>& run, Solution& solution);

/// CPU time of this process so far [s].
double cpu_seconds();

/// CPU times by Google Benchmark: after a warm-up, every run is repeated (9 times; 3 times when it takes over 0.2 s or
/// `quick`), each repetition long enough for the clock, all repetitions of all runs in random order, so that a slow
/// moment of the machine meets all alike. Runs in other processes are believed: Solution::own_seconds.
/// @param progress  called with a line of text when a share of the work is done
std::vector<Timing> time_runs(const std::vector<TimedRun>& runs, bool quick,
                              const std::function<void(double)>& progress);

}  // namespace ricochet
