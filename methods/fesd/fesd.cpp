#include <fmt/format.h>

#include "methods/elements/bilateral_support.h"
#include "methods/fesd/fesd_run.h"
#include "methods/fesd/reused_solver.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// FESD-J, the discrete equations of each simulation step (methods/elements/stage_equations.h) solved by pivoting
/// (pivoting_solver.h).
/// Source: Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, section 3; corrections in DIFFERENCES.md.
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
            .has_sensitivities = true,
            .is_audited = true,
            .impact_laws = all_impact_hypotheses(),
            .has_restitution_of_speed = true,
            .has_static_friction = true,
            .has_regions = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (options_.switches != PivotingSolver::Switches::pinned && options_.facets > 0 && has_friction_in_space(problem))
      return Support::no("switches on a polyhedral friction cone in space are pinned only");
    return can_hold_bilateral(tableau_, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    ReusedSolver reused(problem, tableau_, options_);
    return run(problem, settings, reused);
  }

  std::unique_ptr<Solver> do_prepare(const Problem& problem) const override {
    return std::make_unique<PreparedFesd>(
        problem, tableau_, options_,
        [this, &problem](const Settings& settings, ReusedSolver& reused) { return run(problem, settings, reused); });
  }

 private:
  Solution run(const Problem& problem, const Settings& settings, ReusedSolver& reused) const {
    const bool pinned = options_.switches == PivotingSolver::Switches::pinned;
    if (!settings.sensitivities.empty()) require_sensitivities(problem.info());
    FesdRun steps(problem, tableau_, settings, options_.gap_tolerance,
                  FesdAudit::Claims{.pinned = pinned, .gap_tolerance = options_.gap_tolerance, .cone = cone_},
                  reused.counters());
    PivotingSolver& solver = reused.start(settings.inner_tolerance);
    steps.take_equal_steps(
        solver, [&](double H) { return steps.time_is_over() ? Status::time_limit : solver.advance(H); },
        [&](Status status, const std::string& where) {
          const char* advice = solver.more_elements_may_help() ? "; elements=as_needed may solve it" : "";
          steps.fail(status, where, solver.failure_message() + advice, solver.failure_reason());
        },
        [&](double H, int n) { return solver.skip_steps(H, n); });
    return steps.finish();
  }

  void require_sensitivities(const ProblemInfo& problem) const {
    if (options_.switches != PivotingSolver::Switches::pinned)
      throw InputError(
          fmt::format("{}: sensitivities need switches=pinned, else no equation gives the time of a switch", id_));
    if (options_.facets > 0 && has_friction_in_space(problem))
      throw InputError(fmt::format("{}: there are no sensitivities with a polyhedral friction cone in space", id_));
  }

  std::string id_;
  ButcherTableau tableau_;
  FrictionConeOptions cone_;
  PivotingSolver::Options options_;
};

const bool registered = register_method<Fesd>({
    .name = "fesd",
    .usage = "fesd:TABLEAU:STAGES[,n_fe=2][,elements=fixed|as_needed][,max_elements=64][,"
             "switches=pinned|published|published_earliest][,gap_tolerance=0]"
             "[,cone=exact|squared][,cone=polyhedral[,facets=8]], or fesd:@TABLEAU_FILE",
    .max_arguments = 2,
    .summary = "finite elements with switch detection and jumps (FESD-J), solved by pivoting",
    .examples = {"fesd:radau-iia:1", "fesd:radau-iia:2", "fesd:radau-iia:3", "fesd:radau-iia:4", "fesd:gauss:1",
                 "fesd:gauss:2", "fesd:gauss:3", "fesd:gauss:4", "fesd:radau-ia:3", "fesd:lobatto-iiic:3",
                 "fesd:radau-iia:3,elements=as_needed", "fesd:radau-iia:3,cone=polyhedral,elements=as_needed"},
});

}  // namespace
}  // namespace ricochet
