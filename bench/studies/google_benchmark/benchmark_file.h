#pragma once

#include <optional>
#include <string>

#include "reports/results.h"

namespace ricochet {

/// Reads the output of Google Benchmark (`--benchmark_out=FILE` or `--benchmark_format=json`) as results: its context
/// as their environment, a BenchmarkRow for each benchmark, a ComplexityRow for each fit. The experiment has the name
/// of the program. Google Benchmark writes NaN, which JSON does not have.
/// @param path  for messages  @param text  of the file
/// @return empty for what is none, which is told from results files by its beginning
/// @throws InputError where it is damaged, with the field, or has no benchmark
std::optional<Results> read_benchmarks(const std::string& path, const std::string& text);

}  // namespace ricochet
