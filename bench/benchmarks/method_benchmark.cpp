#include "bench/benchmarks/method_benchmark.h"

#include <benchmark/benchmark.h>

#include <cstdlib>

namespace {

bool counting = false;
std::size_t allocations = 0, bytes = 0;

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
/// In place of the library's, so that Eigen's allocations are counted, too.
void* malloc(std::size_t size) {
  if (counting) {
    ++allocations;
    bytes += size;
  }
  return __libc_malloc(size);
}
}

namespace ricochet {
namespace {

void set_counters(const Counters& c, benchmark::State& state) {
  const auto set = [&](const char* name, std::int64_t value) { state.counters[name] = static_cast<double>(value); };
  set("steps", c.steps);
  set("elements", c.elements);
  set("events", c.events);
  set("force_evaluations", c.force_evaluations);
  set("newton_iterations", c.inner_iterations);
  set("factorizations", c.matrix_factorizations + c.mass_factorizations);
  set("contact_problems", c.complementarity_solves);
  set("allocations", static_cast<std::int64_t>(allocations));
  set("bytes", static_cast<std::int64_t>(bytes));
}

}  // namespace

void register_method_benchmark(const std::string& name, std::shared_ptr<const Method> method,
                               std::shared_ptr<const Problem> problem, const Settings& settings, bool counts_elements) {
  const auto run = [=](benchmark::State& state) {
    const auto solver = method->prepare(*problem);
    Solution solution = solver->solve(settings);
    if (!solution.succeeded()) {
      state.SkipWithError(solution.message.c_str());
      return;
    }
    allocations = bytes = 0;
    counting = true;
    solution = solver->solve(settings);
    counting = false;
    for (auto _ : state) benchmark::DoNotOptimize(solver->solve(settings).t);
    const std::int64_t items = counts_elements ? solution.counters.elements : solution.counters.steps;
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * items);
    set_counters(solution.counters, state);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

int run_benchmarks(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace ricochet
