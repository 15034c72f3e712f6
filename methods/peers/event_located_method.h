#pragma once

#include <string>
#include <utility>

#include "methods/method.h"
#include "reference/event_located.h"

namespace ricochet {

/// An integrator of SUNDIALS as a competitor: the run of the reference with its events, at a tolerance of the user's.
/// SUNDIALS: Hindmarsh et al., ACM TOMS 31 (2005); ARKODE: Reynolds et al., ACM TOMS 49 (2023).
class EventLocatedMethod : public Method {
 public:
  MethodInfo info() const final { return info_; }
  Support supports(const ProblemInfo&) const final { return Support::yes(); }

 protected:
  EventLocatedMethod(MethodInfo info, reference::MakeIntegrator integrator)
      : info_(std::move(info)), integrator_(std::move(integrator)) {
    info_.impact_laws = all_impact_hypotheses();
    info_.has_restitution_of_speed = true;
    info_.has_static_friction = true;
    info_.keeps_samples = false;
    info_.ends_runs = true;
  }

  Solution do_solve(const Problem& problem, const Settings& settings) const final {
    return reference::integrate_event_located(problem, {.integrator = integrator_,
                                                        .tolerance = settings.tolerance,
                                                        .time_limit = settings.time_limit,
                                                        .records_motion = settings.recording == Recording::motion,
                                                        .ends = settings.ends});
  }

 private:
  MethodInfo info_;
  reference::MakeIntegrator integrator_;
};

}  // namespace ricochet
