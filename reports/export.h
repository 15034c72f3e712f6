#pragma once

#include <string>

#include "reports/latex.h"            // IWYU pragma: export
#include "reports/render/pgfplots.h"  // IWYU pragma: export
#include "reports/results.h"

namespace ricochet {

// Export of results for papers and for other programs.

/// One line per run, as CSV: every number with all its digits and NaN where there is none, nested fields joined by '_',
/// names in snake_case. Rows of the kind that most rows have; rows that name one of them by its number ("row", as times do)
/// add their fields to it. Lists of strings are joined by ';', other lists are left out.
/// @throws InputError where the results have no row
std::string tidy_csv(const Results& results);

}  // namespace ricochet
