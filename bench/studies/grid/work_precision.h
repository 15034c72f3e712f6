#pragma once

#include "bench/studies/grid/grid_results.h"
#include "reports/section.h"

namespace ricochet {

/// CPU time over error, all methods and all runs that have both.
Chart work_precision_chart(const GridResults& results);

/// The same runs for a reader who chooses both axes: work is CPU time, or a counter that does not depend on the machine; an
/// error is absolute, relative to the size of the solution, or one of the whole motion. Also runs without a solution.
nlohmann::json work_precision_data(const GridResults& results);

}  // namespace ricochet
