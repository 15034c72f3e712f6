#include <fmt/format.h>

#include "methods/event_driven/event_driven_run.h"
#include "methods/event_driven/explicit_steps.h"
#include "methods/registry.h"

namespace ricochet {
namespace {

/// Explicit Runge-Kutta pairs with step control and located events: event_driven_run.h.
class EventDriven final : public Method {
 public:
  explicit EventDriven(const MethodSpec& spec)
      : id_(spec.text()),
        pair_(spec.arguments().empty() ? explicit_pair_names().front() : spec.arguments()[0]),
        pair_info_(explicit_pair_info(pair_)) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("{}, event-driven", pair_info_.name),
            .source = pair_info_.source,
            .order_smooth = static_cast<double>(pair_info_.order),
            .order_impacts = static_cast<double>(pair_info_.order),
            .is_adaptive = true};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return EventDrivenRun(problem, settings, pair_).solve();
  }

 private:
  std::string id_, pair_;
  ExplicitPairInfo pair_info_;
};

const bool registered = register_method<EventDriven>({
    .name = "event_driven",
    .usage = "event_driven[:PAIR], with --tolerance",
    .max_arguments = 1,
    .summary = "explicit Runge-Kutta pairs with step control, events located and the step taken again up to them",
    .examples = {"event_driven:prince-dormand-8-7", "event_driven:dopri5"},
});

}  // namespace
}  // namespace ricochet
