#pragma once

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet::reference {

enum class Integrator { adams, bdf };

struct EventLocatedSettings {
  Integrator integrator = Integrator::adams;
  double tolerance = 1e-12;  ///< relative, and absolute in SI units
  double time_limit = 0;     ///< wall time [s]; 0 is none
  long max_events = 100000;
  double zeno_interval = 1e-7;  ///< impacts of one contact closer than this part of end_time are an accumulation
};

/// Integrates the smooth phases with CVODE, locates the zeros of open gaps (an impact) and of closed contacts' forces
/// (a detachment) with its root finding, and restarts it behind each event. Mode decisions come from ContactDynamics
/// and use nothing of methods/. A Zeno accumulation cannot be passed and ends the run with Status::step_limit; a gap
/// that became negative unnoticed ends it with Status::inner_solver_failed.
/// @throws InputError for a problem with friction
Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings);

}  // namespace ricochet::reference
