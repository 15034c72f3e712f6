#pragma once

#include <string>
#include <vector>

#include "reports/growth.h"
#include "reports/run.h"
#include "reports/table.h"

namespace ricochet {

// A run of this study has, beside what every run has: parameter "n", the size; values "contacts", possible ones; "active",
// contacts that touch at the end; "solves", contact problems or systems of a stage solver per step; "iterations", inner
// iterations and pivots per step.

/// CPU time of a step, median [s]; NaN where it is not measured.
double step_seconds(const Run& run);

/// One line per run; below those of a method on a scene, the growth exponents in the number of active contacts.
Table scale_table(const std::vector<Run>& runs);
/// Runs without a result, with the reason.
Table scale_failures(const std::vector<Run>& runs);
/// Time of a step over the number of active contacts, a panel per scene.
std::vector<GrowthCurve> scale_curves(const std::vector<Run>& runs);

}  // namespace ricochet
