#include <fmt/format.h>

#include <map>

#include "methods/fesd/record_step.h"
#include "methods/fesd_homotopy/step_homotopy.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "methods/time_limit.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// The value of an option that takes one of a few names; the first is the default.
template <class Value>
Value named(const MethodSpec& spec, const std::string& option,
            const std::vector<std::pair<std::string, Value>>& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  const std::string name = spec.choice(option, names);
  return std::ranges::find(values, name, &std::pair<std::string, Value>::first)->second;
}

bool is_on(const MethodSpec& spec, const std::string& option) {
  return spec.choice(option, {"on", "off"}) == "on";
}

FesdEquations::Options equation_options(const MethodSpec& spec) {
  using E = FesdEquations;
  E::Options options;
  options.n_fe = spec.whole_number("n_fe", 2, 1, 64);
  options.impulses = named<E::Impulses>(
      spec, "impulses", {{"position_velocity", E::Impulses::position_velocity}, {"slack", E::Impulses::slack}});
  options.cone = named<E::Cone>(
      spec, "cone", {{"exact", E::Cone::exact}, {"squared", E::Cone::squared}, {"polyhedral", E::Cone::polyhedral}});
  options.facets = spec.whole_number("facets", 8, 3, 1000);
  options.cross = named<E::CrossComplementarity>(spec, "cross",
                                                 {{"sparse", E::CrossComplementarity::sparse},
                                                  {"per_stage", E::CrossComplementarity::per_stage},
                                                  {"aggregated", E::CrossComplementarity::aggregated}});
  options.equilibration = named<E::Equilibration>(spec, "equilibration",
                                                  {{"objective", E::Equilibration::objective},
                                                   {"exact", E::Equilibration::exact},
                                                   {"tanh", E::Equilibration::tanh},
                                                   {"none", E::Equilibration::none}});
  options.rho = spec.number("rho", 1, 0, 1e10);
  options.shortest = spec.number("shortest", 1e-3, 0, 1);
  options.no_capture = spec.choice("capture", {"off", "on"}) == "off";
  options.eps_c = spec.number("eps_c", 1e-3, 0, 1);
  return options;
}

HomotopyOptions homotopy_options(const MethodSpec& spec) {
  HomotopyOptions options;
  std::vector<std::string> names;
  for (const auto& relaxation : relaxations()) names.emplace_back(relaxation.name);
  options.relaxation = spec.choice("relaxation", names);
  options.sigma_0 = spec.number("sigma_0", 0.1, 1e-12, 1e6);
  options.sigma_final = spec.number("sigma_n", 1e-9, 1e-14, options.sigma_0);
  options.factor = spec.number("factor", 0.1, 1e-6, 0.999);
  options.update = named<SigmaUpdate>(
      spec, "update", {{"linear", SigmaUpdate::linear}, {"superlinear", SigmaUpdate::superlinear}});
  options.power = spec.number("power", 1.5, 1.001, 10);
  options.tolerance = spec.number("tolerance", 1e-10, 1e-13, 1e-2);
  options.warm_multipliers = is_on(spec, "warm");
  options.max_iterations = spec.whole_number("max_iterations", 300, 1, 1000000);
  options.cross_over = is_on(spec, "crossover");
  options.barrier = spec.number("barrier", 0.1, 1e-12, 1e6);
  options.push = spec.number("push", 1e-2, 1e-12, 0.5);
  options.tolerance_per_sigma = spec.number("looseness", 1e-3, 0, 1e6);
  options.max_switches = spec.whole_number("switches", 10, 0, 1000);
  options.descend = false;  // every solution of the equations will do
  return options;
}

/// FESD-J, the discrete equations of each simulation step solved by homotopy (step_homotopy.h).
class FesdHomotopy final : public Method {
 public:
  explicit FesdHomotopy(const MethodSpec& spec) : id_(spec.text()), tableau_(tableau_argument(spec)) {
    using Guess = StepHomotopy::Guess;
    options_.equations = equation_options(spec);
    options_.homotopy = homotopy_options(spec);
    options_.guess = named<Guess>(
        spec, "guess", {{"ballistic", Guess::ballistic}, {"cold", Guess::cold}, {"pivoting", Guess::pivoting}});
    options_.retries = spec.whole_number("retry", 1, 0, 10);
    options_.retry_sigma_0 = spec.number("retry_sigma_0", 0, 0, 1e6);
    spec.finish(2);
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("FESD-J by homotopy, {}, {} finite elements", tableau_.name, options_.equations.n_fe),
            .source = "Nurkanovic, Frey, Pozharskiy, Diehl: FESD-J, sections 3 and 5.1, appendix",
            .order_smooth = static_cast<double>(tableau_.order),
            .order_impacts = static_cast<double>(tableau_.order)};
  }

  Support supports(const ProblemInfo& problem) const override {
    return problem.has_bilateral() ? Support::no("the transcription has no bilateral constraints yet") : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    const ProblemInfo& info = problem.info();
    const double H = info.end_time / settings.steps;
    StepHomotopy solver(problem, tableau_, options_, H);
    const TimeLimit time_limit(settings.time_limit);
    Solution solution;
    solver.start(info.q0, info.v0);
    solution.q = info.q0;
    solution.v = info.v0;
    for (int k = 0; k < settings.steps; ++k) {
      const double t = k * H;
      const Status status = time_limit.is_over() ? Status::time_limit : solver.advance();
      count(solver, solution.counters);
      if (status != Status::success) {
        solution.status = status;
        solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, t,
                                       status == Status::time_limit ? time_limit.message() : solver.solution().message);
        return solution;
      }
      ++solution.counters.steps;
      solution.counters.elements += solver.step().n_elements;
      record_step(problem, settings.recording, solver.step(), solver.previous_step(), t, nullptr, solution);
      solution.q = solver.step().last().q1;
      solution.v = solver.step().last().v1;
      solution.t = k + 1 == settings.steps ? info.end_time : (k + 1) * H;
    }
    return solution;
  }

 private:
  void count(const StepHomotopy& solver, Counters& counters) const {
    const NlpEvaluator::Work work = solver.work();
    const std::int64_t points = options_.equations.n_fe * tableau_.n_s;
    counters.force_evaluations = work.constraints * points;
    counters.jacobian_evaluations = work.jacobians * points;
    counters.complementarity_solves += static_cast<std::int64_t>(solver.solution().steps.size());
    counters.inner_iterations += solver.solution().iterations;
  }

  std::string id_;
  ButcherTableau tableau_;
  StepHomotopy::Options options_;
};

const bool registered = register_method({
    .name = "fesd_homotopy",
    .usage = "fesd_homotopy:TABLEAU:STAGES[,n_fe=2][,guess=ballistic|cold|pivoting]",
    .summary = "finite elements with switch detection and jumps (FESD-J), solved as MPCCs by homotopy",
    .examples = {"fesd_homotopy:radau-iia:2"},
    .make = [](const MethodSpec& spec) -> std::unique_ptr<Method> { return std::make_unique<FesdHomotopy>(spec); },
    .not_built = {},
});

}  // namespace
}  // namespace ricochet
