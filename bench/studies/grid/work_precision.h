#pragma once

#include "bench/studies/grid/grid_results.h"
#include "reports/section.h"

namespace ricochet {

/// Work over error, all methods and all runs that have both: work is CPU time, or a counter that does not depend on the
/// machine; an error is absolute, relative to the size of the solution, or one of the whole motion. Beside them, runs
/// without a solution.
Section::Chart work_precision_chart(const GridResults& results);

}  // namespace ricochet
