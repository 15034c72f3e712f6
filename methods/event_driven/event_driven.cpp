#include <fmt/format.h>

#include "methods/event_driven/event_driven_run.h"
#include "methods/registry.h"
#include "methods/runge_kutta/embedded_tableau.h"

namespace ricochet {
namespace {

// The fastest at most tolerances on most scenes.
constexpr const char* kPair = "prince-dormand-8-7";

/// "dopri5", or "@my_pair.json"
EmbeddedTableau pair_argument(const std::string& text) {
  return text.starts_with('@') ? read_embedded_tableau(text.substr(1)) : embedded_tableau(text);
}

/// The method made ready for one problem.
class PreparedEventDriven final : public Solver {
 public:
  PreparedEventDriven(const Problem& problem, const EmbeddedTableau& pair, int n_samples)
      : problem_(problem), pair_(pair), n_samples_(n_samples), workspace_(problem, pair) {}

  Solution solve(const Settings& settings) override {
    return EventDrivenRun(problem_, settings, pair_, workspace_, n_samples_).solve();
  }

 private:
  const Problem& problem_;
  const EmbeddedTableau& pair_;
  const int n_samples_;
  EventDrivenWorkspace workspace_;
};

/// Explicit Runge-Kutta pairs with step control and located events: event_driven_run.h.
class EventDriven final : public Method {
 public:
  explicit EventDriven(const MethodSpec& spec)
      : id_(spec.text()), pair_(pair_argument(spec.arguments().empty() ? kPair : spec.arguments()[0])) {
    n_samples_ = spec.whole_number("samples", 0, 0, 10'000'000);
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("{}, event-driven", pair_.name),
            .source = pair_.source,
            .order_smooth = static_cast<double>(pair_.order),
            .order_impacts = static_cast<double>(pair_.order),
            .is_adaptive = true,
            .has_sensitivities = true};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    EventDrivenWorkspace workspace(problem, pair_);
    return EventDrivenRun(problem, settings, pair_, workspace, n_samples_).solve();
  }

  std::unique_ptr<Solver> do_prepare(const Problem& problem) const override {
    return std::make_unique<PreparedEventDriven>(problem, pair_, n_samples_);
  }

 private:
  std::string id_;
  EmbeddedTableau pair_;
  int n_samples_ = 0;
};

const bool registered = register_method<EventDriven>({
    .name = "event_driven",
    .usage = "event_driven[:PAIR][,samples=0] or event_driven:@PAIR_FILE, with --tolerance",
    .max_arguments = 1,
    .summary = "explicit Runge-Kutta pairs with step control, events located and the step taken again up to them",
    .examples = {"event_driven:prince-dormand-8-7", "event_driven:dopri5"},
});

}  // namespace
}  // namespace ricochet
