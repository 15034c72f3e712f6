#pragma once

#include <string>
#include <vector>

#include "methods/contact_laws/contacts_after_impact.h"
#include "methods/contact_laws/group_capture.h"
#include "methods/contact_laws/impact_sequence.h"
#include "methods/contact_laws/impact_solver.h"
#include "methods/event_driven/slow_slip.h"
#include "methods/modes/event_functions.h"
#include "methods/modes/mode_dynamics.h"

namespace ricochet {

/// The change of modes at one instant, by the laws that elements of FESD-J start with (contact_laws/): first impacts, one
/// after the other where they coincide (impact_sequence.h); then the load decides which contacts stay closed, and Coulomb's
/// law which of them stick or slip. The state is moved to a point where closed contacts have neither gap nor normal
/// velocity, and sticking contacts no slip.
///
/// A bounce that is lower than rounding of the gap is none: with the rate r = J_n' v- and the acceleration a < 0 of the
/// gap,
///
///   0 < eps_r < 1,   (eps_r r)^2 <= 2 |a| (rounding of the gap)                          (1)
///
/// ends an accumulation of impacts; its rebound is removed, with the friction impulse that belongs to it
/// (ModeDynamics::project). The load of the next moment decides about a contact without one
/// (ImpactSolver::decide_unloaded). A contact without friction that separates, but is pressed in the next moment, stays
/// closed: with the acceleration a and the jerk j of its gap without a force of its own,
///
///   j < 0,   a <= 0 or 2 a^3 <= 3 j^2 (rounding of the gap)                               (2)
///
/// because its flight would be lower than rounding. An example is the end of an elastic bar that an impact has stopped.
///
/// A redundant contact may lose its force though the bodies do not part, since others hold them: its gap has neither rate
/// nor acceleration. Its force would return with the next change of any other one, and vanish again. Such a contact is
/// idle: it closes where its gap has a rate, or an acceleration without its force
///
///   a < -(what redundant contacts may contradict each other by)                           (3)
///
/// or where it has fallen by capture_height().
class ModeChange {
 public:
  ModeChange(const Problem& problem, ContactScales& scales, ModeDynamics& dynamics, Counters& counters);

  struct Outcome {
    Status status = Status::success;
    std::string message;
    FailureReason reason;
    bool has_impact = false;
    bool raises = false;           ///< contacts that have sunk (group_capture.h)
    bool holds_slow_slip = false;  ///< slow slip counts as rest (slow_slip.h)
  };

  /// Before a run.
  void restart(double tolerance) { slow_slip_.restart(tolerance); }
  /// Before decide(): counts the event. @param since  time since the last one [s]
  void count(const DetectedEvent& cause, double since) { slow_slip_.count(cause, since); }
  /// Whether slow slip counts as rest at the events counted so far.
  bool holds_slow_slip() const { return slow_slip_.is_followed_enough(); }

  /// After it: dynamics with the new modes, (q, v) with v+. @param modes  before; null at the start of a run
  /// @param stopped  contacts whose slip ends besides that of the cause
  Outcome decide(const DetectedEvent& cause, const std::vector<ContactMode>* modes, Vector& q, Vector& v,
                 const std::vector<int>& stopped);

  /// Open contacts that may sink before they close again: refused ones (group_capture.h) and idle ones.
  const std::vector<int>& may_sink() const { return may_sink_; }
  const GroupInstant& groups() const { return group_.instant(); }
  /// See ImpactSequence.
  void keep_impacts(std::vector<ImpactSequence::Impact>* impacts) { impacts_.keep_impacts(impacts); }

  const Vector& Lambda_n() const { return Lambda_n_; }
  const Vector& Lambda_t() const { return Lambda_t_; }
  /// Contacts in space that begin to slip from rest; the dynamics holds their directions.
  const std::vector<int>& beginning() const { return beginning_; }

 private:
  Outcome failed(Status status, FailureCode code, const std::string& what, int contact) const;
  Outcome accumulated(int n_impacts, const Vector& v) const;
  Outcome no_progress() const;
  Outcome close(const DetectedEvent& cause, const std::vector<ContactMode>* modes, Outcome outcome, Vector& q,
                Vector& v, const std::vector<int>& stopped, bool may_hold);
  bool find_forces(const Vector& q, const Vector& v);
  void set_closed(const DetectedEvent& cause, const std::vector<ContactMode>* modes, const Vector& q, const Vector& v,
                  const std::vector<int>& stopped);
  bool is_low(int contact, const Vector& q, const Vector& v_minus);
  double free_gap_acceleration(int contact, const Vector& q, const Vector& v);
  bool is_pressed_at_once(int contact, double a, const Vector& q, const Vector& v);
  bool hops(int contact, const Vector& q, const Vector& v);
  void leave_idle(const DetectedEvent& cause, const Vector& q, const Vector& v);
  bool add_pressed(const Vector& q, const Vector& v);
  void find_idle(const std::vector<ContactMode>& before, const Vector& q, const Vector& v);
  double gap_acceleration(int contact, const Vector& q, const Vector& v);

  const Problem& problem_;
  const ProblemInfo& info_;
  ContactScales& scales_;
  ModeDynamics& dynamics_;
  ImpactSolver law_;
  ImpactSequence impacts_;
  GroupCapture group_;
  SlowSlip slow_slip_;
  std::vector<int> touching_, beginning_;
  std::vector<int> idle_, may_sink_;
  double no_acceleration_ = 0;  // of (3)
  std::vector<ContactMode> modes_;
  std::vector<ContactAfterImpact> after_;
  std::vector<ImpactSolver::ClosedContact> closed_;
  Vector Lambda_n_, Lambda_t_, lambda_n_, lambda_t_, v_minus_, bias_, gap_acceleration_;
  std::vector<ContactMode> modes_held_;  // before slow slip is removed
  Vector q_held_, v_held_;
};

}  // namespace ricochet
