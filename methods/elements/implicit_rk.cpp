#include <fmt/format.h>

#include "methods/elements/bilateral_support.h"
#include "methods/elements/element_motion.h"
#include "methods/elements/element_solver.h"
#include "methods/regions/until_run.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "methods/time_limit.h"

namespace ricochet {
namespace {

/// A bare implicit Runge-Kutta method for q' = v, M v' = f_v + B_u u (stage_equations.h, contacts open): the measure of
/// what FESD-J costs where nothing switches. It refuses scenes with unilateral contacts unless told to ignore them;
/// bilateral constraints are part of the motion.
class ImplicitRungeKutta final : public Method {
 public:
  explicit ImplicitRungeKutta(const MethodSpec& spec) : id_(spec.text()), tableau_(tableau_argument(spec)) {
    ignores_contacts_ = spec.choice("contacts", {"refused", "ignored"}) == "ignored";
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("implicit Runge-Kutta, {}", tableau_.name),
            .source = "Hairer, Wanner, Solving Ordinary Differential Equations II, section IV.5",
            .order_smooth = static_cast<double>(tableau_.order),
            .order_impacts = 0,
            .is_adaptive = false,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (!problem.unilateral.empty() && !ignores_contacts_) {
      return Support::no("it knows no contacts; contacts=ignored integrates the motion without them");
    }
    return can_hold_bilateral(tableau_, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    Solution solution;
    ElementSystem elements(problem, tableau_, solution.counters);
    ElementSolver solver(elements, settings.inner_tolerance);
    const ElementMotion motion(tableau_);
    const TimeLimit time_limit(settings.time_limit);
    const double h = problem.info().end_time / settings.steps;
    Element step, next;
    for (Element* s : {&step, &next}) s->resize(problem.info(), tableau_.n_s);
    step.h = next.h = h;
    step.q1 = problem.info().q0;
    step.v1 = problem.info().v0;
    for (int k = 0; k < settings.steps; ++k) {
      if (k > 0) elements.tableau.extrapolate(step, next);
      next.q0 = step.q1;
      next.v0 = step.v1;
      const bool converged = !time_limit.is_over() && solver.solve(next) == ElementSolver::Result::converged;
      if (!converged) {
        solution.status = time_limit.is_over() ? Status::time_limit : Status::inner_solver_failed;
        solution.message =
            fmt::format("step {} of {}: {}", k + 1, settings.steps,
                        time_limit.is_over() ? time_limit.message() : "Newton's method did not converge");
        break;
      }
      std::swap(step, next);
      ++solution.counters.steps;
      ++solution.counters.elements;
      solution.t = k + 1 == settings.steps ? problem.info().end_time : (k + 1) * h;
      if (settings.recording >= Recording::grid) solution.samples.push_back({solution.t, step.q1, step.v1, step.v1});
      if (settings.recording == Recording::motion) motion.add(k * h, solution.t, step, solution.motion);
      if (ends_here(settings, solution.t, step.q1, step.v1)) break;
    }
    solution.q = step.q1;
    solution.v = step.v1;
    return solution;
  }

 private:
  std::string id_;
  ButcherTableau tableau_;
  bool ignores_contacts_;
};

const bool registered = register_method<ImplicitRungeKutta>({
    .name = "irk",
    .usage = "irk:TABLEAU:STAGES[,contacts=refused|ignored], or irk:@TABLEAU_FILE",
    .max_arguments = 2,
    .summary = "bare implicit Runge-Kutta method, for motion without contacts",
    .examples = {"irk:radau-iia:3", "irk:gauss:4"},
});

}  // namespace
}  // namespace ricochet
