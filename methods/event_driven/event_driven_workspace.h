#pragma once

#include <memory>

#include "methods/contact_laws/capture_height.h"
#include "methods/contact_laws/contact_scales.h"
#include "methods/event_driven/mode_change.h"
#include "methods/event_driven/step_formula.h"
#include "methods/modes/event_functions.h"
#include "methods/modes/mode_dynamics.h"

namespace ricochet {

/// Workspace of an EventDrivenRun, made once for many runs of one problem.
struct EventDrivenWorkspace {
  /// Problem and formula must outlive this object.
  EventDrivenWorkspace(const Problem& problem, const StepFormula& formula)
      : scales(problem),
        dynamics(problem, counters),
        functions(problem, scales, dynamics, degree_between_ends(formula)),
        mode_change(problem, scales, dynamics, counters),
        step(make_step(formula, problem.n_q(), dynamics)) {}
  EventDrivenWorkspace(const EventDrivenWorkspace&) = delete;

  /// Prepares a run from any state. Its counters start at zero; those of the first run include the work that is done
  /// only once. @throws InputError as CaptureHeight::set()
  void start(const Problem& problem, double tolerance, const CaptureHeight& capture_height) {
    if (has_run) counters = {};
    has_run = true;
    scales.restart();
    capture_height.set(problem, tolerance, scales);
    dynamics.start(scales.redundant());
    functions.start(tolerance);
    step->start(tolerance);
    mode_change.keep_impacts(nullptr);
  }

  Counters counters;
  ContactScales scales;
  ModeDynamics dynamics;
  EventFunctions functions;
  ModeChange mode_change;
  std::unique_ptr<StepScheme> step;

 private:
  bool has_run = false;
};

}  // namespace ricochet
