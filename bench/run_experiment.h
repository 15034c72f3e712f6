#pragma once

#include <string>

#include "bench/experiment.h"

namespace ricochet {

struct RunOptions {
  std::string folder = "out/results";
  bool quick = false;  ///< no runs above 20000 steps, three repetitions
  bool with_times = true;
  double time_limit = 60;    ///< per run [s]
  std::string command_line;  ///< for the header
};

/// Runs an experiment and returns the path of its results file. First every run once, audited, with its error against
/// the reference; then, in one session, the times of all that succeeded. Results of the same experiment by the same
/// program are taken as they are; an interrupted run is continued.
std::string run_experiment(const Experiment& experiment, const RunOptions& options);

}  // namespace ricochet
