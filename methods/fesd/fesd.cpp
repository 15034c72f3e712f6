#include <fmt/format.h>

#include "methods/elements/bilateral_support.h"
#include "methods/fesd/fesd_audit.h"
#include "methods/fesd/pivoting_solver.h"
#include "methods/fesd/record_step.h"
#include "methods/fesd/sensitivity.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "methods/time_limit.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// FESD-J, the discrete equations of each simulation step solved by pivoting (pivoting_solver.h).
/// Source: Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, section 3; corrections in the README of this folder.
class Fesd final : public Method {
 public:
  explicit Fesd(const MethodSpec& spec) : id_(spec.text()), tableau_(tableau_argument(spec)) {
    options_.n_fe = spec.whole_number("n_fe", 2, 1, 64);
    options_.as_needed = spec.choice("elements", {"fixed", "as_needed"}) == "as_needed";
    using Switches = PivotingSolver::Switches;
    const std::string switches = spec.choice("switches", {"pinned", "published", "published_earliest"});
    options_.switches = switches == "pinned"      ? Switches::pinned
                        : switches == "published" ? Switches::published
                                                  : Switches::published_earliest;
    cone_ = cone_argument(spec);
    options_.facets = cone_.facets;
    options_.gap_tolerance = spec.number("gap_tolerance", 0, 0, 1);
    options_.max_elements = spec.whole_number("max_elements", 64, 1, 100000);
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("FESD-J, {}, {} finite elements{}", tableau_.name, options_.n_fe,
                                 options_.as_needed ? " or more" : ""),
            .source = "Nurkanovic, Frey, Pozharskiy, Diehl: FESD-J, section 3",
            .order_smooth = static_cast<double>(tableau_.order),
            .order_impacts = static_cast<double>(tableau_.order),
            .is_adaptive = false,
            .has_sensitivities = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (options_.switches != PivotingSolver::Switches::pinned && options_.facets > 0 && has_friction_in_space(problem))
      return Support::no("switches on a polyhedral friction cone in space are pinned only");
    return can_hold_bilateral(tableau_, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    Solution solution;
    PivotingSolver::Options options = options_;
    options.tolerance = settings.inner_tolerance;
    PivotingSolver solver(problem, tableau_, options, solution.counters);
    std::optional<FesdAudit> audit;
    if (settings.audit)
      audit.emplace(problem, tableau_, options.switches == PivotingSolver::Switches::pinned, options.gap_tolerance,
                    cone_);
    std::optional<Sensitivity> sensitivity;
    if (!settings.sensitivities.empty()) {
      if (options.switches != PivotingSolver::Switches::pinned)
        throw InputError(
            fmt::format("{}: sensitivities need switches=pinned, else no equation gives the time of a switch", id_));
      if (options.facets > 0 && has_friction_in_space(problem.info()))
        throw InputError(fmt::format("{}: there are no sensitivities with a polyhedral friction cone in space", id_));
      sensitivity.emplace(problem, tableau_, settings.sensitivities);
    }
    const TimeLimit time_limit(settings.time_limit);

    const ProblemInfo& info = problem.info();
    const double H = info.end_time / settings.steps;
    solver.start(info.q0, info.v0);
    const Element* reached = nullptr;  // the last element that was solved
    for (int k = 0; k < settings.steps; ++k) {
      const double t = k * H;
      const Status status = time_limit.is_over() ? Status::time_limit : solver.advance(H);
      if (status != Status::success) {
        solution.status = status;
        const bool has_hint = status != Status::time_limit && solver.more_elements_may_help();
        solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}{}", k + 1, settings.steps, t,
                                       status == Status::time_limit ? time_limit.message() : solver.failure_message(),
                                       has_hint ? "; elements=as_needed may solve it" : "");
        break;
      }
      const FesdStep& step = solver.step();
      if (sensitivity && step.has_impact_sequence()) {
        solution.status = Status::infeasible;
        solution.message =
            fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, t, Sensitivity::kNoDerivative);
        break;
      }
      if (sensitivity) sensitivity->add(step, (k + 1.0) / settings.steps * sensitivity->dt_final());
      const FesdStep* previous = solver.previous_step();
      record_step(problem, settings.recording, step, previous, t, sensitivity ? &*sensitivity : nullptr, solution);
      if (audit) audit->add(step, previous, t);
      reached = &step.last();
      solution.t = k + 1 == settings.steps ? info.end_time : (k + 1) * H;
    }
    solution.q = reached ? reached->q1 : info.q0;
    solution.v = reached ? reached->v1 : info.v0;
    if (audit) solution.residuals = audit->residuals();
    if (sensitivity) {
      solution.dq = sensitivity->dq();
      solution.dv = sensitivity->dv();
    }
    return solution;
  }

 private:
  std::string id_;
  ButcherTableau tableau_;
  FrictionConeOptions cone_;
  PivotingSolver::Options options_;
};

const bool registered = register_method<Fesd>({
    .name = "fesd",
    .usage = "fesd:TABLEAU:STAGES[,n_fe=2][,elements=fixed|as_needed][,max_elements=64][,"
             "switches=pinned|published|published_earliest][,gap_tolerance=0][,"
             "cone=exact|squared|polyhedral][,facets=8], or fesd:@TABLEAU_FILE",
    .max_arguments = 2,
    .summary = "finite elements with switch detection and jumps (FESD-J), solved by pivoting",
    .examples = {"fesd:radau-iia:1", "fesd:radau-iia:2", "fesd:radau-iia:3", "fesd:radau-iia:4", "fesd:gauss:1",
                 "fesd:gauss:2", "fesd:gauss:3", "fesd:gauss:4", "fesd:radau-ia:3", "fesd:lobatto-iiic:3",
                 "fesd:radau-iia:3,elements=as_needed", "fesd:radau-iia:3,cone=polyhedral,elements=as_needed"},
});

}  // namespace
}  // namespace ricochet
