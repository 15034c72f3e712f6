#pragma once

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/cvode.h"
#include "reference/integrator.h"

namespace ricochet::reference {

struct EventLocatedSettings {
  MakeIntegrator integrator = adams;
  double tolerance = 1e-12;     ///< of an unknown y relative to |y| + its size by Scales
  double time_limit = 0;        ///< wall time [s]; 0 is none
  long max_steps = 10'000'000;  ///< of the integrator, over the whole run
  long max_events = 100'000;
  bool records_motion = false;  ///< fills Solution::motion with the integrator's own interpolation
  double zeno_interval = 1e-9;  ///< impacts of one contact closer than this part of end_time are an accumulation
};

/// Integrates the smooth phases, locates with the integrator's root finding where a gap closes, a contact force
/// vanishes, a friction force reaches its cone or a slip velocity zero, and restarts it behind each event; impacts that
/// begin and end within one of its steps are found by StepWatch. Mode decisions come from ContactLaws and use nothing
/// of methods/. Every threshold is a part of a size that Scales states.
///
/// Ends early with Status::step_limit where impacts of several contacts accumulate (Zeno), which it cannot pass, naming
/// those that take part, at max_steps or max_events, and where 20 000
/// steps move the time by less than 1e-6 of the end time, with the contacts that hold it up; with Status::inner_solver_failed where no combination of contact modes
/// fits ("inconsistent"), several with different motions do ("indeterminate"), or an event was passed unnoticed. Forces
/// of redundant contacts that are not unique are divided by steadiest_division() as long as the motion is.
Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings);

}  // namespace ricochet::reference
