#pragma once

#include <limits>

#include "problems/solution.h"

namespace ricochet {

/// Removes everything that depends on the speed and load of the machine. @param run  a ControlRun or a SeedRun
void leave_times_out(auto& run) {
  run.seconds = std::numeric_limits<double>::quiet_NaN();
  if constexpr (requires { run.cpu_seconds; }) run.cpu_seconds = run.seconds;
  if constexpr (requires { run.solve_cpu_seconds; }) run.solve_cpu_seconds = run.seconds;
  if (run.status != to_string(Status::time_limit)) return;
  run.iterations = 0;
  run.message.clear();
}

}  // namespace ricochet
