#pragma once

#include <string>
#include <vector>

#include "reports/metrics.h"
#include "reports/section.h"

namespace ricochet {

/// A run that succeeded, and its metrics if its motion was looked at.
struct MeasuredRun {
  std::string scene;  ///< empty where all runs are of one
  std::string method, setting;
  Metrics metrics;
  double reference_error = 0;  ///< bound for the error of the reference
  double solution_size = 0;    ///< max-norm of its end
};

/// Adds three tables, a line per run each: "motions", errors against the reference motion at all times, of events,
/// impulses, momentum and energy; "laws", how deep bodies are in each other, and residuals by law in impacts; "contacts",
/// residuals by law in persistent contact. Runs that were not looked at are counted in a note, with why; of no other run,
/// or no such contact, there is no table.
void show_metrics(const std::vector<MeasuredRun>& runs, Section& section);

}  // namespace ricochet
