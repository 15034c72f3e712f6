#include <fmt/format.h>

#include "bench/experiment/study.h"
#include "bench/studies/google_benchmark/benchmark_file.h"
#include "bench/studies/google_benchmark/benchmark_rows.h"

namespace ricochet {
namespace {

/// Reasons to doubt the times of a machine, in sentences.
std::string warnings_of(const nlohmann::json& environment) {
  std::string text;
  if (environment.value("library_build_type", "") == "debug")
    text += " Warning: a debug build of Google Benchmark has measured; times of nanoseconds have its overhead.";
  if (environment.value("cpu_scaling_enabled", "") == "true")
    text += " Warning: the processor changes its frequency; times of different runs are not comparable.";
  return text;
}

void show_benchmarks(const Results& results, Section& section) {
  const auto rows = results.all<BenchmarkRow>();
  const auto fits = results.all<ComplexityRow>();
  if (const auto chart = benchmark_chart(rows, results.experiment())) section.chart(*chart);
  section.result("benchmarks",
                 benchmark_table(rows,
                                 "Times of an iteration; of repetitions the median, with their standard deviation "
                                 "over the mean as spread." +
                                     warnings_of(results.header.value("environment", nlohmann::json::object()))));
  if (!fits.empty()) section.result("complexity", complexity_table(fits));
  section.failures("failures", benchmark_failures(rows));
}

const bool google_benchmark_is_registered = register_study(
    {.kind = kBenchmarkStudy,
     .summary = "programs of Google Benchmark: their JSON is read, `bench_step --benchmark_out=FILE`",
     .fields = {},
     .rows = {BenchmarkRow::kKind, ComplexityRow::kKind},
     .read_foreign = read_benchmarks,
     .run =
         [](const nlohmann::json& experiment, ResultsFile&) {
           throw InputError("kind", experiment.at("kind").dump(), "programs of Google Benchmark run this kind");
         },
     .show = show_benchmarks,
     .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
