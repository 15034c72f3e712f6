#pragma once

#include <string>
#include <vector>

#include "bench/gate/gate.h"
#include "bench/studies/google_benchmark/benchmark_rows.h"
#include "reports/results.h"

namespace ricochet {

/// The counters of a program of Google Benchmark, as a gate holds them against a baseline; its times are not held. With
/// c_0 the counter in the baseline, a benchmark holds when
///
///   c <= c_0                          for what no last bit decides: allocations, and sizes of programs          (1)
///   c <= c_0 + max(2, c_0 / 10)       for work: steps, iterations, pivots, ...                                  (2)
///   c <= c_0 + max(10, c_0 / 2)       for factorizations                                                        (3)
///
/// (2) and (3) are (3) and (4) of GateRules. Bytes depend on the alignment that a build asks for, residuals are rounding:
/// neither is held, nor a counter of another name. Fewer never block. What only one of the two has does, and is named: a
/// benchmark, or a counter of one.
struct CounterResults {
  CounterResults() = default;
  /// @throws InputError for results of another study, or a counter that is held and is not a whole number >= 0
  explicit CounterResults(const Results& results);

  struct Benchmark {
    BenchmarkRow row;  ///< with the counters that are held, and no others
    int line = 0;      ///< of the file; 0 where it has no lines
  };

  std::string path, id;
  std::vector<Benchmark> benchmarks;  ///< those that have such a counter, or failed
};

/// @throws InputError for results of another program
GateReport hold_against(const CounterResults& baseline, const CounterResults& results);

/// A baseline is a results file with the counters that are held. @throws InputError when it cannot be read, holds
/// nothing, or has a benchmark twice
CounterResults read_counter_baseline(const std::string& path);
/// @throws InputError for results that would be no baseline, and when the file exists or cannot be written
void write_baseline(const CounterResults& results, const std::string& path);

}  // namespace ricochet
