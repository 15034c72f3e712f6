// A run of every method on every scene that it supports: METHOD/SCENE/N, or METHOD/SCENE/TOLERANCE. Items are steps.
//
//   bench_step --benchmark_filter='^fesd:.*/two_balls_spring/' --benchmark_format=json
#include <fmt/format.h>

#include <map>

#include "bench/benchmarks/benchmark_program.h"
#include "bench/benchmarks/method_benchmark.h"
#include "methods/registry.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

constexpr int kSteps = 200;
constexpr double kTolerance = 1e-6;
constexpr double kTimeLimit = 5;  // [s] of a run, after which it is an error

void register_all() {
  std::map<std::string, std::shared_ptr<const Problem>> problems;
  for (const auto& scene : scenes()) problems[scene.id] = make_problem(scene.id);
  for (const auto& entry : methods()) {
    if (!entry.make) continue;  // not built
    for (const auto& spec : entry.examples) {
      const std::shared_ptr<const Method> method = make_method(spec);
      const bool is_adaptive = method->info().is_adaptive;
      Settings settings;
      settings.time_limit = kTimeLimit;
      settings.recording = Recording::final_state;
      if (is_adaptive)
        settings.tolerance = kTolerance;
      else
        settings.steps = kSteps;
      for (const auto& [id, problem] : problems) {
        if (!method->can_run(problem->info()).ok) continue;
        const std::string setting = is_adaptive ? fmt::format("{:g}", kTolerance) : std::to_string(kSteps);
        register_method_benchmark(fmt::format("{}/{}/{}", spec, id, setting), method, problem, settings, false);
      }
    }
  }
}

}  // namespace
}  // namespace ricochet

int main(int argc, char** argv) {
  ricochet::register_all();
  return ricochet::run_benchmarks(argc, argv);
}
