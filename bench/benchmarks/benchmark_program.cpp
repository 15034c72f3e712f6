#include "bench/benchmarks/benchmark_program.h"

#include "bench/measure/environment.h"

namespace ricochet {

int run_benchmarks(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const auto here = environment();
  for (const char* key : {"revision", "compiler", "flags", "processor"})
    benchmark::AddCustomContext(key, here.value(key, "unknown"));
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace ricochet
