#pragma once

#include <string>

#include "bench/studies/grid/grid_results.h"

namespace ricochet {

/// A baseline is a results file of methods on a grid with nothing in it but what a gate holds (gate.h): per run method,
/// setting, step length, status, error, residual and counters, rounded to the digits that are compared. Neither times
/// nor machine nor date: made again, it differs where the numbers do. Any results file of the study can serve as one.
///
/// Every field of a row that is compared has to be there with its type, in a baseline and in results that are held
/// against one; read_results() takes the default for one that is missing, and an error of 0 would be the best there is.
/// @throws InputError with file, line and field when the file cannot be read, is damaged, not complete, or of another
/// study
GridResults gated_results(const Results& results);
/// The same of a file.
GridResults read_gated_results(const std::string& path);

/// The same for a baseline, which has to be possible, too: no row twice, no negative error, and no success without an
/// error where other runs have one. @throws InputError
GridResults read_baseline(const std::string& path);

/// @throws InputError for results that would be no baseline, as read_baseline() says, or an empty one, and when the
/// file cannot be written
void write_baseline(const GridResults& results, const std::string& path);

}  // namespace ricochet
