#include <fmt/format.h>

#include "methods/event_driven/event_driven_run.h"
#include "methods/registry.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

// The fastest at most tolerances on most scenes.
constexpr const char* kPair = "prince-dormand-8-7";

/// "dopri5", "@my_pair.json" or "radau-iia:5"
StepFormula formula_argument(const MethodSpec& spec) {
  const auto& arguments = spec.arguments();
  if (arguments.empty()) return embedded_tableau(kPair);
  if (arguments[0] == "radau-iia") {
    const std::string stages = arguments.size() > 1 ? arguments[1] : "5";
    if (stages != "3" && stages != "5")
      throw InputError(fmt::format("radau-iia: stages = {}: one of 3, 5 is required", stages));
    return tableau_argument("radau-iia:" + stages);
  }
  if (arguments.size() > 1)
    throw InputError(fmt::format("{}: argument '{}': a pair has none", arguments[0], arguments[1]));
  return arguments[0].starts_with('@') ? read_embedded_tableau(arguments[0].substr(1)) : embedded_tableau(arguments[0]);
}

/// The method made ready for one problem.
class PreparedEventDriven final : public Solver {
 public:
  PreparedEventDriven(const Problem& problem, const StepFormula& formula, const CaptureHeight& capture_height,
                      int n_samples)
      : problem_(problem),
        formula_(formula),
        capture_height_(capture_height),
        n_samples_(n_samples),
        workspace_(problem, formula) {}

  Solution solve(const Settings& settings) override {
    return EventDrivenRun(problem_, settings, formula_, capture_height_, workspace_, n_samples_).solve();
  }

 private:
  const Problem& problem_;
  const StepFormula& formula_;
  const CaptureHeight capture_height_;
  const int n_samples_;
  EventDrivenWorkspace workspace_;
};

/// Runge-Kutta steps with error control and located events: event_driven_run.h.
class EventDriven final : public Method {
 public:
  explicit EventDriven(const MethodSpec& spec)
      : id_(spec.text()), formula_(formula_argument(spec)), capture_height_(spec) {
    n_samples_ = spec.whole_number("samples", 0, 0, 10'000'000);
  }

  MethodInfo info() const override {
    if (const auto* pair = std::get_if<EmbeddedTableau>(&formula_))
      return describe(pair->name, pair->source, pair->order, true);
    const auto& radau = std::get<ButcherTableau>(formula_);
    return describe(fmt::format("Radau IIA of order {}", radau.order),
                    "Hairer, Wanner, Solving Ordinary Differential Equations II, section IV.8", radau.order, false);
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    EventDrivenWorkspace workspace(problem, formula_);
    return EventDrivenRun(problem, settings, formula_, capture_height_, workspace, n_samples_).solve();
  }

  std::unique_ptr<Solver> do_prepare(const Problem& problem) const override {
    return std::make_unique<PreparedEventDriven>(problem, formula_, capture_height_, n_samples_);
  }

 private:
  MethodInfo describe(const std::string& name, const std::string& source, int order, bool has_sensitivities) const {
    return {.id = id_,
            .title = fmt::format("{}, event-driven", name),
            .source = source,
            .order_smooth = static_cast<double>(order),
            .order_impacts = static_cast<double>(order),
            .is_adaptive = true,
            .has_sensitivities = has_sensitivities,
            .impact_laws = all_impact_hypotheses(),
            .has_restitution_of_speed = true,
            .has_static_friction = true,
            .has_regions = true,
            .has_islands = n_samples_ == 0 && !capture_height_.is_stated(),  // both refer to the whole
            .is_allocation_free = true};
  }

  std::string id_;
  StepFormula formula_;
  CaptureHeight capture_height_;
  int n_samples_ = 0;
};

const bool registered = register_method<EventDriven>({
    .name = "event_driven",
    .usage = "event_driven[:PAIR][,samples=0][,capture_height=m] or event_driven:@PAIR_FILE or "
             "event_driven:radau-iia:STAGES, with --tolerance",
    .max_arguments = 2,
    .summary =
        "explicit Runge-Kutta pairs, or Radau IIA, with step control, events located and the step taken again up to them",
    .examples = {"event_driven:prince-dormand-8-7", "event_driven:dopri5", "event_driven:radau-iia:3",
                 "event_driven:radau-iia:5"},
});

}  // namespace
}  // namespace ricochet
