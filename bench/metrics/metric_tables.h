#pragma once

#include <string>
#include <vector>

#include "reports/metrics.h"
#include "reports/section.h"

namespace ricochet {

/// A run whose motion was looked at.
struct MeasuredRun {
  std::string scene;  ///< empty where all runs are of one
  std::string method, setting;
  Metrics metrics;
  double reference_error = 0;  ///< bound for the error of the reference
  double solution_size = 0;    ///< max-norm of its end
};

/// Adds three tables, a line per run each: "motions", errors against the reference motion at all times, of events,
/// impulses, momentum and energy; "laws", how deep bodies are in each other, and residuals by law in impacts; "contacts",
/// residuals by law in persistent contact. Of no run, or no such contact, none.
void show_metrics(const std::vector<MeasuredRun>& runs, Section& section);

}  // namespace ricochet
