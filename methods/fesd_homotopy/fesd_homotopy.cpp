// FESD-J as published: the equations of a step are a program with complementarity constraints, solved by homotopy.
//
// The unknowns x of a step of length H are those of its finite elements: each has its length h_n, the impulse Lambda_n,
// Lambda_t and the velocity v_0 after it at its left end, and at its stages j positions, velocities, accelerations and
// forces, with
//
//   q_j = q_0 + h_n sum_k a_jk v_k,   v_j = v_0 + h_n sum_k a_jk w_k                                        (1)
//   0 = M(q_j) w_j - f_v(q_j,v_j) - B_u u - sum_i (J_n^i lambda_n,j^i + J_t^i lambda_t,j^i)                 (2)
//   0 = M(q_0) (v_0 - v^-) - sum_i (J_n^i Lambda_n^i + J_t^i Lambda_t^i),   sum_n h_n = H                   (3)
//
// F(x) = 0 are (1) to (3) with the rows that define slack variables, and 0 <= G_i _|_ K_i >= 0 all pairs: a force with
// the gap at every stage of its element, an impulse with the gap and with either part of its impact law, friction
// forces with parts of the slip. methods/mpcc_equations/fesd_equations.h has each. A step is then
//
//   min over x of rho sum_n (h_n - h_{n-1})^2   where   F(x) = 0,   0 <= G_i(x)  _|_  K_i(x) >= 0           (4)
//
// whose objective, the equilibration of the lengths, is there to fix what switches leave open. (4) has no interior.
// Its relaxation with sigma > 0 does, by Scholtes unless the option `relaxation` says another,
//
//   min over x of rho sum_n (h_n - h_{n-1})^2   where   F(x) = 0,   G_i, K_i >= 0,   G_i K_i <= sigma       (5)
//   sigma_{k+1} = min(factor sigma_k, sigma_k^{3/2}),   from sigma_0 down to sigma_n                        (6)
//
// Ipopt solves (5) for each sigma of (6) from the solution before; `update=linear` leaves the power out. Then the
// crossover fixes in each pair the one that is zero, and solves what remains: with `crossover=off` the last (5) stands.
// The guess and what a step does that fails are in step_homotopy.h.
//
// Source: Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, sections 3 and 5.1, appendix; corrections in
// methods/fesd/DIFFERENCES.md.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "methods/fesd/fesd_run.h"
#include "methods/fesd_homotopy/options.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

constexpr double kGapAccuracy = 1e-6;  // of the relaxed complementarity at the end of a homotopy

class FesdHomotopy final : public Method {
 public:
  explicit FesdHomotopy(const MethodSpec& spec) : id_(spec.text()), tableau_(tableau_argument(spec)) {
    options_ = step_homotopy_options(spec);
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("FESD-J by homotopy, {}, {} finite elements", tableau_.name, options_.equations.n_fe),
            .source = "Nurkanovic, Frey, Pozharskiy, Diehl: FESD-J, sections 3 and 5.1, appendix",
            .order_smooth = static_cast<double>(tableau_.order),
            .order_impacts = static_cast<double>(tableau_.order)};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (!problem.structure.has_formulas) return Support::no("the transcription needs the formulas of the scene");
    if (has_levers(problem))
      return Support::no("a relaxation does not close and open the contacts of a lever together, problem.h (10)");
    return problem.has_bilateral() ? Support::no("the transcription has no bilateral constraints yet") : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    const auto begin = std::chrono::steady_clock::now();
    StepHomotopy solver(problem, tableau_, options_, problem.info().end_time / settings.steps);
    // A step takes milliseconds to seconds, so the clock is read before and within each.
    const auto seconds_left = [&] {
      return settings.time_limit - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    Counters counters;
    FesdRun run(problem, tableau_, settings, kGapAccuracy, std::nullopt, counters);
    solver.start(problem.info().q0, problem.info().v0);
    run.take_equal_steps(
        solver,
        [&](double) {
          const double left = seconds_left();
          if (settings.time_limit > 0 && left <= 0) return Status::time_limit;
          const Status status = solver.advance(std::max(left, 0.0));
          count(solver, status, counters);
          return status;
        },
        [&](Status status, const std::string& where) { run.fail(status, where, solver.solution().message); });
    return run.finish();
  }

 private:
  void count(const StepHomotopy& solver, Status status, Counters& counters) const {
    const NlpEvaluator::Work work = solver.work();
    const std::int64_t points = options_.equations.n_fe * tableau_.n_s;
    counters.force_evaluations = work.constraints * points;
    counters.jacobian_evaluations = work.jacobians * points;
    counters.complementarity_solves += static_cast<std::int64_t>(solver.solution().steps.size());
    counters.inner_iterations += solver.solution().iterations;
    if (status != Status::success) return;
    ++counters.steps;
    counters.elements += solver.step().n_elements;
  }

  std::string id_;
  ButcherTableau tableau_;
  StepHomotopy::Options options_;
};

const bool registered = register_method<FesdHomotopy>({
    .name = "fesd_homotopy",
    .usage = "fesd_homotopy:TABLEAU:STAGES[,n_fe=2][,guess=ballistic|cold|pivoting][,relaxation=scholtes|...]"
             "[,sigma_0=1e-3][,sigma_n=1e-11][,update=superlinear|linear][,factor=0.1][,crossover=on|off][,retry=3]"
             "[,tolerance=1e-11][,impulses=position_velocity|slack][,cone=exact][,cone=squared,crossover=off]"
             "[,cone=polyhedral[,facets=8]]"
             "[,cross=sparse|per_stage|aggregated][,equilibration=objective|exact|tanh|none][,rho=1][,eps_c=1e-3]"
             "[,capture=on|off][,shortest=1e-3][,branches=3][,max_iterations=300]",
    .max_arguments = 2,
    .summary = "finite elements with switch detection and jumps (FESD-J), solved as MPCCs by homotopy",
    .examples = {"fesd_homotopy:radau-iia:3,retry=0,max_iterations=100,branches=0"},
    .conformance_steps = 20,  // milliseconds a step
});

}  // namespace
}  // namespace ricochet
