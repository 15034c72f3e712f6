#include "bench/benchmarks/method_benchmark.h"

#include "bench/benchmarks/benchmark_program.h"

namespace ricochet {
namespace {

void set_counters(const Counters& c, benchmark::State& state) {
  set_counter(state, "steps", c.steps);
  set_counter(state, "elements", c.elements);
  set_counter(state, "events", c.events);
  set_counter(state, "force_evaluations", c.force_evaluations);
  set_counter(state, "newton_iterations", c.inner_iterations);
  set_counter(state, "factorizations", c.matrix_factorizations + c.mass_factorizations);
  set_counter(state, "contact_problems", c.complementarity_solves);
}

}  // namespace

void register_method_benchmark(const std::string& name, std::shared_ptr<const Method> method,
                               std::shared_ptr<const Problem> problem, const Settings& settings, bool counts_elements) {
  const auto run = [=](benchmark::State& state) {
    const auto solver = method->prepare(*problem);
    const Solution solution = solver->solve(settings);
    if (!solution.succeeded()) {
      state.SkipWithError(solution.message.c_str());
      return;
    }
    measure(state, counts_elements ? solution.counters.elements : solution.counters.steps,
            [&] { benchmark::DoNotOptimize(solver->solve(settings).t); });
    set_counters(solution.counters, state);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

}  // namespace ricochet
