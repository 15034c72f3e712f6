#pragma once

#include <string>
#include <vector>

#include "bench/gate/gate.h"
#include "bench/studies/google_benchmark/benchmark_rows.h"
#include "reports/results.h"

namespace ricochet {

/// Compares the counters of a Google Benchmark program with a baseline; times are not compared. With c_0 the counter in
/// the baseline, a benchmark passes if
///
///   c <= c_0                          for counters independent of rounding: allocations, sizes of programs      (1)
///   c <= c_0 + max(2, c_0 / 10)       for work: steps, iterations, pivots, ...                                  (2)
///   c <= c_0 + max(10, c_0 / 2)       for factorizations                                                        (3)
///
/// (2) and (3) are (3) and (4) of GateRules. Bytes depend on the alignment of a build and residuals are rounding
/// errors; neither is compared, nor a counter with another name. Smaller counters never fail. A benchmark or a counter
/// in only one of the two files fails and is named.
struct CounterResults {
  CounterResults() = default;
  /// @throws InputError for results of another study, or a compared counter that is not an integer >= 0
  explicit CounterResults(const Results& results);

  struct Benchmark {
    BenchmarkRow row;  ///< with the compared counters only
    int line = 0;      ///< in the file; 0 if it has no lines
  };

  std::string path, id;
  std::vector<Benchmark> benchmarks;  ///< those that have such a counter, or failed
};

/// @throws InputError for results of another program
GateReport hold_against(const CounterResults& baseline, const CounterResults& results);

/// Reads a baseline, a results file with the compared counters. @throws InputError if it cannot be read, is empty,
/// or has a benchmark twice
CounterResults read_counter_baseline(const std::string& path);
/// @throws InputError for results that are not a valid baseline, and if the file exists or cannot be written
void write_baseline(const CounterResults& results, const std::string& path);

}  // namespace ricochet
