// Assembly of transcribed optimal control problems, at their guess: DISCRETISATION/PROBLEM/N/WHAT, N control intervals,
// WHAT of objective, gradient, constraints, jacobian, and hessian, that of the Lagrangian with all multipliers 1. Items
// are evaluations.
//
//   bench_transcription --benchmark_filter='^fesd/.*/hessian'
#include <fmt/format.h>

#include <map>

#include "bench/benchmarks/benchmark_program.h"
#include "bench/control/control_options.h"
#include "methods/complementarity/mpcc/nlp_evaluator.h"

namespace ricochet {
namespace {

/// A transcription at a point, with room for what is evaluated there.
struct Assembly {
  explicit Assembly(const std::string& arguments)
      : options(ControlOptions::parse(arguments)),
        problem(options.make_problem()),
        transcription(options.make_transcription(*problem)),
        evaluator(transcription->mpcc().nlp),
        x(evaluator.nlp().n_variables()),
        gradient(x.size()),
        g(evaluator.nlp().n_rows()),
        lambda(g.size(), 1),
        jacobian(evaluator.jacobian_pattern().size()),
        hessian(evaluator.hessian_pattern().size()) {
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = evaluator.nlp().variables[k].guess;
  }

  const ControlOptions options;
  const std::unique_ptr<OptimalControlProblem> problem;
  const std::unique_ptr<Transcription> transcription;
  NlpEvaluator evaluator;
  std::vector<double> x, gradient, g, lambda, jacobian, hessian;
};

/// Made when it is asked for, since finding the structure of a large one takes a while; the last one is kept.
Assembly& assembly_of(const std::string& arguments) {
  static std::string kept_arguments;
  static std::unique_ptr<Assembly> kept;
  if (!kept || kept_arguments != arguments) kept = std::make_unique<Assembly>(arguments);
  kept_arguments = arguments;
  return *kept;
}

struct Evaluation {
  const char* what;
  void (*evaluate)(Assembly& a);
  int (*nonzeros)(const Assembly& a);
};

constexpr Evaluation kEvaluations[] = {
    {"objective", [](Assembly& a) { benchmark::DoNotOptimize(a.evaluator.objective(a.x.data())); },
     [](const Assembly&) { return 1; }},
    {"gradient", [](Assembly& a) { a.evaluator.gradient(a.x.data(), a.gradient.data()); },
     [](const Assembly& a) { return a.evaluator.nlp().n_variables(); }},
    {"constraints", [](Assembly& a) { a.evaluator.constraints(a.x.data(), a.g.data()); },
     [](const Assembly& a) { return a.evaluator.nlp().n_rows(); }},
    {"jacobian", [](Assembly& a) { a.evaluator.jacobian(a.x.data(), a.jacobian.data()); },
     [](const Assembly& a) { return a.evaluator.jacobian_pattern().size(); }},
    {"hessian", [](Assembly& a) { a.evaluator.hessian(a.x.data(), 1, a.lambda.data(), a.hessian.data()); },
     [](const Assembly& a) { return a.evaluator.hessian_pattern().size(); }},
};

void run(const std::string& arguments, const Evaluation& evaluation, benchmark::State& state) {
  Assembly& assembly = assembly_of(arguments);
  measure(state, 1, [&] {
    evaluation.evaluate(assembly);
    benchmark::ClobberMemory();
  });
  set_counter(state, "variables", assembly.evaluator.nlp().n_variables());
  set_counter(state, "constraints", assembly.evaluator.nlp().n_rows());
  set_counter(state, "pairs", static_cast<std::int64_t>(assembly.transcription->mpcc().pairs.size()));
  set_counter(state, "nonzeros", evaluation.nonzeros(assembly));
}

void register_all() {
  for (const auto& problem : control_problems()) {
    for (const int intervals : {10, 20, 40}) {
      for (const char* discretisation : {"fesd", "time_stepping"}) {
        const std::string arguments =
            fmt::format("{} --discretisation {} --intervals {}", problem.id, discretisation, intervals);
        for (const Evaluation& evaluation : kEvaluations) {
          const std::string name = fmt::format("{}/{}/{}/{}", discretisation, problem.id, intervals, evaluation.what);
          benchmark::RegisterBenchmark(name.c_str(), [=, &evaluation](benchmark::State& state) {
            run(arguments, evaluation, state);
          })->Unit(benchmark::kMicrosecond);
        }
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
