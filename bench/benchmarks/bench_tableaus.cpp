// Elements of FESD-J over the number of stages: TABLEAU:STAGES/SCENE/N. Items are elements. The first scene has affine
// phases, the second nonlinear forces, the third a joint, the fourth friction in space.
//
//   bench_tableaus --benchmark_filter='^gauss:.*/two_balls_spring/'
#include <fmt/format.h>

#include "bench/benchmarks/benchmark_program.h"
#include "bench/benchmarks/method_benchmark.h"
#include "methods/registry.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

constexpr int kSteps = 100;

void register_all() {
  for (const char* id : {"two_balls_spring", "double_pendulum_wall", "pendulum_wall_cartesian", "ball_3d"}) {
    const std::shared_ptr<const Problem> problem = make_problem(id);
    for (const char* tableau : {"radau-iia", "gauss"}) {
      for (int n_s = 1; n_s <= 6; ++n_s) {
        const std::shared_ptr<const Method> method =
            make_method(fmt::format("fesd:{}:{},elements=as_needed", tableau, n_s));
        if (!method->can_run(problem->info()).ok) continue;
        Settings settings;
        settings.steps = kSteps;
        settings.recording = Recording::final_state;
        register_method_benchmark(fmt::format("{}:{}/{}/{}", tableau, n_s, id, kSteps), method, problem, settings,
                                  true);
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
