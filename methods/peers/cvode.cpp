#include <fmt/format.h>

#include "methods/peers/event_located_method.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// CVODE, the integrator of the reference, on the equations of motion between events (reference/contact_dynamics.h),
/// y' = f(y) with y = (q, v). Its linear multistep formulas of variable order and step are, for BDF with k1 = k <= 5 and
/// k2 = 0, for Adams with k1 = 1 and k2 = k - 1 <= 11,
///
///   sum_{i=0}^k1 alpha_{n,i} y_{n-i} + h_n sum_{i=0}^k2 beta_{n,i} y_{n-i}' = 0          (6)
///
/// At events, which its root finding locates, the laws of an instant give what is after, and CVODE starts anew.
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
