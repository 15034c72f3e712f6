#pragma once

#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

constexpr const char* kBenchmarkStudy = "google_benchmark";

/// A benchmark of a program of Google Benchmark. Of repetitions the median, or the mean where there is none; where the
/// file has neither, the first of them.
struct BenchmarkRow {
  static constexpr const char* kKind = "benchmark";
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  std::string name;
  double real_seconds = kNone, cpu_seconds = kNone;  ///< of an iteration
  double items_per_second = kNone;                   ///< NaN where it counts none
  int repetitions = 1;
  std::string aggregate;  ///< "median", "mean"; empty for one measurement
  double spread = kNone;  ///< standard deviation of the CPU time of repetitions over its mean
  std::map<std::string, double> counters;
  std::string error;  ///< why it was not measured

  bool succeeded() const { return error.empty(); }
  double seconds_per_item() const { return 1 / items_per_second; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(BenchmarkRow, name, real_seconds, cpu_seconds, items_per_second,
                                                repetitions, aggregate, spread, counters, error)

/// Growth of the time of a family of benchmarks, fitted by Google Benchmark.
struct ComplexityRow {
  static constexpr const char* kKind = "complexity";

  std::string name;
  std::string big_o;                 ///< "N", "NlgN"
  double cpu_seconds = 0;            ///< coefficient of the CPU time
  double real_seconds = 0;           ///< and of the real time
  double rms = BenchmarkRow::kNone;  ///< of the fit, relative
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ComplexityRow, name, big_o, cpu_seconds, real_seconds, rms)

/// METHOD/SCENE/N/WHAT: N is the last part that is a whole number, the scene the second part, the curve all others.
struct BenchmarkName {
  std::string curve, scene;
  double n = 0;  ///< 0: none

  static BenchmarkName parse(const std::string& name);
};

Table benchmark_table(const std::vector<BenchmarkRow>& rows, const std::string& note);
Table benchmark_failures(const std::vector<BenchmarkRow>& rows);
Table complexity_table(const std::vector<ComplexityRow>& rows);

/// Times over N where some benchmark was measured for several, else how fast each method is, over all scenes; none where no
/// time is known.
std::optional<Chart> benchmark_chart(const std::vector<BenchmarkRow>& rows, const std::string& file);

}  // namespace ricochet
