#pragma once

#include <string>

#include "bench/studies/grid/grid_results.h"

namespace ricochet {

/// A baseline is a results file of a method grid with only the fields that a gate compares (gate.h): method, setting,
/// step length, status, error, residual and counters of each run, rounded to the compared digits. It contains no times,
/// machine or date, so that it changes only with the numbers. Any results file of the study can serve as one.
///
/// Every compared field must be present with its type, in a baseline and in the results: read_results() uses the
/// default for a missing field, and an error of 0 would be the best possible one.
/// @throws InputError with file, line and field if the file cannot be read, is damaged, incomplete, or of another
/// study
GridResults gated_results(const Results& results);
/// gated_results() of a file.
GridResults read_gated_results(const std::string& path);

/// gated_results() of a baseline file, which must also be consistent: no row twice, no negative error, and no success
/// without an error if other runs have one. @throws InputError
GridResults read_baseline(const std::string& path);

/// @throws InputError for results that read_baseline() would reject, for an empty baseline, and if the file cannot be
/// written
void write_baseline(const GridResults& results, const std::string& path);

}  // namespace ricochet
