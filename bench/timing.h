#pragma once

#include <functional>
#include <string>
#include <vector>

#include "reports/timing.h"

namespace ricochet {

/// A run to be timed.
struct TimedRun {
  std::string name;
  double expected_seconds = 0;  ///< from an earlier, single measurement; decides the number of repetitions
  std::function<void()> run;
};

/// CPU times by Google Benchmark: after a warm-up, every run is repeated (9 times; 3 times when it takes over 0.2 s or
/// `quick`), each repetition long enough for the clock, all repetitions of all runs in random order, so that a slow
/// moment of the machine meets all alike.
/// @param progress  called with a line of text when a share of the work is done
std::vector<Timing> measure(const std::vector<TimedRun>& runs, bool quick, const std::function<void(double)>& progress);

}  // namespace ricochet
