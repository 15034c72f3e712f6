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
  bool records_motion = false;       ///< fills Solution::motion with the integrator's own interpolation
  Vector border_offset = {};         ///< of a region: n_s, delta of regions.h (1)
  Vector border_limit = {};          ///< of a region: n_s, of regions.h (2)
  EndsRun ends = nullptr;            ///< of pieces of scenes with a mu_static
  std::vector<char> in_flight = {};  ///< by contact, of the region before (Flights::in_flight()); empty for the first
  double zeno_interval = 1e-9;  ///< impacts of one contact closer than this fraction of end_time are an accumulation
};

/// Integrates the smooth phases and restarts the integrator after each event. Its root finding locates closing gaps,
/// vanishing contact forces, friction forces that reach their cones, and slip velocities that reach zero. StepWatch
/// finds impacts that start and end within one step. Mode decisions come from ContactLaws and use nothing of methods/.
/// Every threshold is a fraction of a size of Scales.
///
/// Ends where ProblemInfo::until vanishes. A scene with a mu_static is run piece by piece (StaticFrictionRun).
///
/// Ends early with Status::step_limit at an accumulation of impacts of several contacts (Zeno), at max_steps or
/// max_events, and if 20 000 steps advance the time by less than 1e-6 of the end time; the message names the contacts.
/// Ends with Status::inner_solver_failed if no combination of contact modes fits ("inconsistent"), if several with
/// different motions fit ("indeterminate"), or if an event was missed. If the motion is unique and the forces of
/// redundant contacts are not, steadiest_division() divides them.
Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings);

}  // namespace ricochet::reference
