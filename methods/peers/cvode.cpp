#include <fmt/format.h>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "reference/event_located.h"

namespace ricochet {
namespace {

/// SUNDIALS' CVODE with event location as a competitor: the integrator of the reference, at a tolerance of the user's.
/// Source: Hindmarsh et al., SUNDIALS, ACM TOMS 31 (2005); event location: CVODE's root finding, Illinois algorithm.
class CvodeWithEvents final : public Method {
 public:
  explicit CvodeWithEvents(const MethodSpec& spec) : id_(spec.text()) {
    const std::string name = spec.arguments().empty() ? "adams" : spec.arguments()[0];
    if (name != "adams" && name != "bdf") throw InputError("cvode: integrator", name, "one of adams, bdf is required");
    integrator_ = name == "adams" ? reference::Integrator::adams : reference::Integrator::bdf;
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("CVODE {} with events", integrator_ == reference::Integrator::adams ? "Adams" : "BDF"),
            .source = "Hindmarsh et al., ACM TOMS 31 (2005)",
            .order_smooth = integrator_ == reference::Integrator::adams ? 12.0 : 5.0,
            .order_impacts = integrator_ == reference::Integrator::adams ? 12.0 : 5.0,
            .is_adaptive = true};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return reference::integrate_event_located(
        problem, {.integrator = integrator_, .tolerance = settings.tolerance, .time_limit = settings.time_limit});
  }

 private:
  std::string id_;
  reference::Integrator integrator_;
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
