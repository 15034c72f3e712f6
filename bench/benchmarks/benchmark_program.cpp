#include "bench/benchmarks/benchmark_program.h"

#include <cstdlib>

#include "bench/environment.h"

namespace {

thread_local bool counting = false;
thread_local ricochet::Allocations allocations;

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
/// In place of the library's, so that Eigen's allocations are counted, too.
void* malloc(std::size_t size) {
  if (counting) {
    ++allocations.count;
    allocations.bytes += static_cast<std::int64_t>(size);
  }
  return __libc_malloc(size);
}
}

namespace ricochet {

Allocations allocations_of(const std::function<void()>& work) {
  allocations = {};
  counting = true;
  work();
  counting = false;
  return allocations;
}

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
