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

/// Integrates the smooth phases with CVODE, locates with its root finding where a gap closes, a contact force vanishes,
/// a friction force reaches its cone or a slip velocity zero, and restarts it behind each event; impacts that begin and
/// end within one of its steps are found by DippingGaps. Mode decisions come from ContactDynamics and use nothing of
/// methods/.
///
/// Ends early with Status::step_limit at a Zeno accumulation, which it cannot pass, and with
/// Status::inner_solver_failed where no combination of contact modes fits ("inconsistent"), several do
/// ("indeterminate", also where redundant contacts leave their forces undetermined), or an event was passed unnoticed.
Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings);

}  // namespace ricochet::reference
