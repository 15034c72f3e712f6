#include <fmt/format.h>

#include "methods/peers/event_located_method.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// CVODE, the integrator of the reference, on the equations of motion between events (reference/contact_dynamics.h).
class CvodeWithEvents final : public EventLocatedMethod {
 public:
  explicit CvodeWithEvents(const MethodSpec& spec) : CvodeWithEvents(spec, uses_adams(spec)) {}

 private:
  CvodeWithEvents(const MethodSpec& spec, bool adams)
      : EventLocatedMethod({.id = spec.text(),
                            .title = fmt::format("CVODE {} with events", adams ? "Adams" : "BDF"),
                            .source = "Hindmarsh et al., ACM TOMS 31 (2005)",
                            .order_smooth = adams ? 12.0 : 5.0,
                            .order_impacts = adams ? 12.0 : 5.0,
                            .is_adaptive = true},
                           adams ? reference::adams : reference::bdf) {}

  static bool uses_adams(const MethodSpec& spec) {
    const std::string name = spec.arguments().empty() ? "adams" : spec.arguments()[0];
    if (name != "adams" && name != "bdf") throw InputError("cvode: integrator", name, "one of adams, bdf is required");
    return name == "adams";
  }
};

const bool registered = register_method<CvodeWithEvents>({
    .name = "cvode",
    .usage = "cvode:adams or cvode:bdf, with --tolerance",
    .max_arguments = 1,
    .summary = "SUNDIALS CVODE, restarted at events that its root finding locates",
    .examples = {"cvode:adams", "cvode:bdf"},
});

}  // namespace
}  // namespace ricochet
