#pragma once

#include <optional>
#include <string>

#include "methods/contact_laws/force_spans.h"
#include "methods/contact_laws/group_record.h"
#include "methods/event_driven/event_driven_workspace.h"
#include "methods/event_driven/event_sensitivity.h"
#include "methods/event_driven/slip_start.h"
#include "methods/method.h"
#include "methods/modes/step_control.h"
#include "methods/progress_limit.h"
#include "methods/regions/region_border.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "methods/step_check.h"
#include "methods/time_limit.h"

namespace ricochet {

/// Smooth motion from event to event, with step lengths that follow the tolerance. If a function of EventFunctions
/// falls through zero, the step is repeated up to that point, and ModeChange determines the next modes.
/// The lengths are those of StepControl; the length is kept after an event.
///
/// The zero of a function phi is the one of the interpolation first; the step to it leaves
///
///   dt = -phi / phi'                                                                                    (1)
///
/// and is taken again with h + dt while
///
///   dt^2 (|a| + |a_1 - a_0| / h) > tolerance / 100                                                      (2)
///
/// The last dt is one of Taylor's polynomial. If (2) remains true, the steps to
/// successive points do not belong to one motion: the step is rejected and halved.
///
/// An event that neither the ends nor the stages of a step show is caused by something shorter than the step, such as a
/// pulse of a load. The next step is no longer than that.
///
/// Samples are the ends of the steps, or dense: at k T / n_samples, each by a step of its own from the left end of the
/// step at hand. They therefore have the order of the pair, unlike the interpolation (step_ends.h, order 5 in v), and
/// change no step.
class EventDrivenRun {
 public:
  /// All references must outlive this object. @param formula  with derivatives an explicit pair
  /// @param workspace  of this problem and formula
  /// @param n_samples  of Recording::grid; 0: the ends of the steps
  EventDrivenRun(const Problem& problem, const Settings& settings, const StepFormula& formula,
                 const CaptureHeight& capture_height, EventDrivenWorkspace& workspace, int n_samples = 0);

  Solution solve();

 private:
  bool ends_here() const;
  bool begin();
  bool take_step();
  bool check_step();
  bool leaves_region(double h);
  bool reach_first(DetectedEvent& event, double& h);
  bool reach(DetectedEvent& event, double& h);
  bool land(double h);
  bool change_modes(const DetectedEvent& cause);
  bool vary_event();
  bool start_slip();
  bool hold_middle_directions(const std::vector<int>& contacts, double h);
  bool start_slip_at_held_directions();
  bool hold_directions(const std::vector<int>& contacts, double h, bool in_middle);
  double harmless_length(const std::vector<int>& contacts) const;
  bool has_started(const std::vector<int>& contacts);
  bool sample_start(double h, const Vector& angles, const std::vector<int>& contacts);
  bool settle_slip(const DetectedEvent& event);
  bool pass_slip(const DetectedEvent& event);
  void record_motion(double end);
  void bound_motion();
  void record(const DetectedEvent& cause, const Vector& v_minus);
  bool sample_until(double end);
  bool sample_until(double end, const auto& reach);
  bool accelerate();
  bool stop(Status status, const std::string& message, FailureReason reason = {});
  bool stop_undetermined();
  double slip_speed(int contact);
  bool stop_too_short();
  bool stop_accumulation(const DetectedEvent& cause);
  void shorten(double h, const DetectedEvent& cause);

  const Problem& problem_;
  const ProblemInfo& info_;
  const Settings& settings_;
  const double tolerance_, T_;
  const int n_samples_;
  const TimeLimit time_limit_;
  Counters& counters_;
  ContactScales& scales_;
  ModeDynamics& dynamics_;
  EventFunctions& functions_;
  ModeChange& mode_change_;
  StepScheme& step_;
  StepEnds& ends_;
  Solution solution_;
  std::optional<EventSensitivity> sensitivity_;
  std::vector<ImpactSequence::Impact> impacts_;  // of the instant, if derivatives are requested
  std::optional<SlipStart> slip_start_;
  std::vector<ContactMode> before_;
  std::vector<int> stopped_;  // contacts in space that stop at this instant
  Vector v_minus_;
  Matrix path_;        // of bound_motion()
  Vector path_error_;  // likewise
  StepCheck check_;
  RegionBorder border_;
  ProgressLimit progress_;
  ForceSpans spans_;
  GroupRecord groups_;
  StepControl control_;
  double t_ = 0, h_ = 0;    // [s]; the length of the next step
  double last_event_ = -1;  // [s]
  double last_pass_ = -1;   // [s], of slip in space that has slowed down to v_stop
  int next_sample_ = 1;
  int standstills_ = 0;         // consecutive events at the same time, up to rounding
  DetectedEvent shortened_by_;  // the last step that became shorter; none: by its error
};

}  // namespace ricochet
