// The contact problem of one time step by every contact solver: SOLVER/SCENE/N, N contacts. A problem is that of a run
// of moreau_jean with the most contacts. Items are contact problems; every one is solved from zero by a new solver,
// since solvers remember. The residual is that of the laws with the disc, where lemke has a polygon in space.
//
//   bench_contacts --benchmark_filter='/sphere_pile/'
#include <fmt/format.h>

#include "bench/benchmarks/benchmark_program.h"
#include "bench/contacts/contact_recorder.h"
#include "bench/contacts/contact_solutions.h"
#include "methods/registry.h"
#include "methods/time_stepping/common/time_stepping_method.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

struct RecordedScene {
  const char* id;
  std::vector<int> sizes;  ///< values of its parameter n; empty: it has none
  ParameterChanges changes = {};
  int steps = 50;
};

/// Without friction, with friction in the plane and in space, with more contacts than forces are unique for.
const std::vector<RecordedScene> kScenes = {
    {"bead_row", {8, 16, 32}, {{"speed", 0}}},
    {"block_column", {4, 16, 64}},
    {"block_on_feet", {4, 16}},
    {"sphere_pile", {5, 10, 30}},
    {"box_3d", {}},
};

using Stored = std::shared_ptr<const StoredContactProblem>;

/// @throws std::runtime_error where the run meets no contact
Stored record(const RecordedScene& scene, const ParameterChanges& changes) {
  const auto problem = make_problem(scene.id, changes);
  const auto method = make_method("moreau_jean");
  ContactRecorder recorder(std::nullopt);
  dynamic_cast<TimeSteppingMethod&>(*method).set_contact_observer(&recorder);
  Settings settings;
  settings.steps = scene.steps;
  settings.recording = Recording::final_state;
  method->solve(*problem, settings);
  if (!recorder.found()) throw std::runtime_error(fmt::format("{}: no contact problem", scene.id));
  return std::make_shared<const StoredContactProblem>(std::move(recorder.stored()));
}

void run(const Stored& stored, const ContactSolverOptions& options, benchmark::State& state) try {
  const ContactProblem& problem = stored->problem;
  Vector r;
  Counters work;
  const auto solve = [&] {
    r.setZero(problem.G.n_rows());
    return solve_afresh(problem, options, r, work);
  };
  if (const ContactStatus status = solve(); status != ContactStatus::solved) {
    state.SkipWithError(reason_of(status));
    return;
  }
  measure(state, 1, [&] { benchmark::DoNotOptimize(solve()); });
  Vector w(problem.G.n_rows());
  state.counters["residual"] = violation(problem, r, FrictionPolygon(), w);
  set_counter(state, "solver_iterations", work.inner_iterations);
  set_counter(state, "pivots", work.pivots);
  set_counter(state, "factorizations", work.matrix_factorizations);
} catch (const InputError& error) {  // a problem that the solver declines
  state.SkipWithError(error.what());
}

void register_scene(const RecordedScene& scene, const ParameterChanges& changes) {
  const Stored stored = record(scene, changes);
  for (const auto& solver : usual_solvers(stored->problem.G.n_contacts())) {
    const std::string name = fmt::format("{}/{}/{}", solver, scene.id, stored->problem.G.n_contacts());
    const ContactSolverOptions options = contact_solver_options(solver);
    benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
      run(stored, options, state);
    })->Unit(benchmark::kMicrosecond);
  }
}

void register_all() {
  for (const auto& scene : kScenes) {
    ParameterChanges changes = scene.changes;
    if (scene.sizes.empty()) register_scene(scene, changes);
    for (const int n : scene.sizes) {
      changes["n"] = n;
      register_scene(scene, changes);
    }
  }
}

}  // namespace
}  // namespace ricochet

int main(int argc, char** argv) {
  ricochet::register_all();
  return ricochet::run_benchmarks(argc, argv);
}
