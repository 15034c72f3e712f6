#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/motion.h"
#include "problems/problem.h"

/// @file
/// Solution, the result of a run: final state, events, counters and status.

namespace ricochet {

/// How a run ended. Every status but success has a message.
enum class Status {
  success,              ///< the end time was reached
  infeasible,           ///< the discrete equations of a step have no solution, or none was found; see the message
  inner_solver_failed,  ///< Newton's method, linear algebra or a complementarity solver failed
  step_limit,           ///< the method's limit of steps or events was reached
  time_limit,           ///< Settings::time_limit was reached
  non_finite,           ///< a state or a force is not a finite number
};

/// The name of `status` in files and tables: "success", "inner_solver_failed" and so on.
const char* to_string(Status status);

/// Reasons of failures that decide a verdict.
enum class FailureCode : std::uint8_t {
  not_stated,          ///< no verdict depends on it; or the method does not state it
  impacts_accumulate,  ///< impacts of the contacts follow each other faster and faster
  painleve,            ///< slip pulls the bodies together: one of the next two
  inconsistent,        ///< no impulses or forces of the contacts fulfil the contact laws
  indeterminate,       ///< several impulses or forces do, and the motion, at once or later, depends on the choice
};

/// Reason of a failure as data; Solution::message is the text for readers.
struct FailureReason {
  FailureCode code = FailureCode::not_stated;  ///< what the failure is
  std::vector<std::string> contacts = {};      ///< names of those that it concerns
};

/// Work, counted in the same way by every method.
struct Counters {
  std::int64_t steps = 0;                   ///< simulation steps accepted
  std::int64_t elements = 0;                ///< Runge-Kutta steps accepted (finite elements, internal steps)
  std::int64_t force_evaluations = 0;       ///< f_v + B_u u
  std::int64_t jacobian_evaluations = 0;    ///< derivatives of f_v, M, J_n at one point
  std::int64_t mass_factorizations = 0;     ///< of M
  std::int64_t matrix_factorizations = 0;   ///< of Newton matrices
  std::int64_t linear_solves = 0;           ///< with a factorised Newton matrix or mass matrix
  std::int64_t complementarity_solves = 0;  ///< contact problems of one instant or one step
  std::int64_t inner_iterations = 0;        ///< Newton iterations
  std::int64_t pivots = 0;                  ///< of complementarity solvers
  std::int64_t events = 0;                  ///< changes of the active set, whether recorded or not
};

/// Mode of a contact between two events. In the plane, slip has the sign of the slip velocity v_t [m/s]. In space it
/// has a direction, which may turn. If a polygon replaces the friction disc, a vertex or an edge of the polygon carries
/// the force.
enum class ContactMode : std::uint8_t {
  open,           ///< no force
  closed,         ///< touches, without friction
  stick,          ///< touches, and its slip velocity is zero
  slip_positive,  ///< slips in the plane, v_t > 0
  slip_negative,  ///< slips in the plane, v_t < 0
  slip,           ///< slips in space, on the friction disc
  vertex_slip,    ///< slips in space, with the force at a vertex of the polygon
  edge_slip       ///< slips in space, with the force on an edge of the polygon
};

/// The name of `mode` in files and tables: "open", "stick", "slip+" and so on.
const char* to_string(ContactMode mode);

/// Whether a contact of this `mode` touches.
inline bool is_closed(ContactMode mode) {
  return mode != ContactMode::open;
}
/// Whether a contact of this `mode` slips, in the plane or in space.
inline bool is_slipping(ContactMode mode) {
  return mode >= ContactMode::slip_positive;
}
/// Sign of the slip velocity of a `mode` in the plane; 0 for all other modes.
inline int slip_sign(ContactMode mode) {
  return mode == ContactMode::slip_positive ? 1 : mode == ContactMode::slip_negative ? -1 : 0;
}

/// The mode of a contact that slips with velocity `v_t` (`n_t` components [m/s]), not zero; "closed" without tangent
/// directions.
inline ContactMode slip_mode(int n_t, const double* v_t) {
  if (n_t == 0) return ContactMode::closed;
  if (n_t == 2) return ContactMode::slip;
  return v_t[0] > 0 ? ContactMode::slip_positive : ContactMode::slip_negative;
}

/// Kind of change of a contact at an instant.
enum class EventKind {
  impact,         ///< it gets an impulse: v jumps
  detach,         ///< it opens
  slip_to_stick,  ///< its slip velocity becomes zero and stays there
  stick_to_slip,  ///< its friction force leaves the cone
  slip_reversal,  ///< its slip velocity goes through zero
  facet_change    ///< another vertex or edge of the friction polygon carries its force while it slips
};

/// The name of `kind` in files and tables: "impact", "slip_to_stick" and so on.
const char* to_string(EventKind kind);

/// The event of a contact that changes from the mode `before` to the mode `after`; none if nothing happens.
/// @param before, after  modes to the left and to the right of the instant
/// @param has_impulse    it gets an impulse
/// @param slip_ended     its slip ended, and may start again with the same mode
std::optional<EventKind> event_kind(ContactMode before, ContactMode after, bool has_impulse, bool slip_ended = false);

/// A change of the active set. Left and right limits differ at an impact only.
struct Event {
  double t = 0;                        ///< [s]
  EventKind kind = EventKind::impact;  ///< what happens
  int contact = -1;                    ///< number of the contact, from 0
  Vector q;                            ///< n_q, state there
  Vector v_minus;                      ///< n_q, left limit of v
  Vector v_plus;                       ///< n_q, right limit of v
  Vector Lambda_n;                     ///< n_c [N s], normal impulses; zero unless an impact
  Vector Lambda_t;                     ///< n_lambda_t [N s], friction impulses, by tangent_index; see problem.h (9)
  std::vector<ContactMode> modes;      ///< n_c, of all contacts after the event; empty if the method has no modes
  Vector dt;                           ///< derivatives of t, as Solution::dq
};

/// State at a grid point, both limits of the velocity.
struct Sample {
  double t = 0;    ///< [s]
  Vector q;        ///< n_q
  Vector v_minus;  ///< n_q, left limit of v
  Vector v_plus;   ///< n_q, right limit of v
};

/// Largest relative residual of one equation of a method over a run, and where it was found.
struct Residual {
  std::string name;             ///< name of the equation, "complementarity"
  std::string formula;          ///< as text, with the number of its publication
  double value = 0;             ///< the largest of the run, relative
  double t = 0;                 ///< start of the step [s]
  int contact = -1;             ///< -1: not of a contact
  std::int64_t impossible = 0;  ///< points at which the equation has no solution whatever its unknowns; not in `value`
};

/// A group of contacts that was closed at one instant, in place of infinitely many impacts that become ever lower
/// (methods/contact_laws/group_rest.h). Its numbers are those of the motion normal to the contacts that was removed; by
/// (3) there, they bound the change of the state.
struct CapturedGroup {
  double t = 0;        ///< [s]
  int n_contacts = 0;  ///< of the group
  double height = 0;   ///< largest gap, or height of the next bounce, of one of its contacts [m]
  double speed = 0;    ///< largest normal velocity of one of its contacts [m/s]
};

/// Contacts between which a body may be held or fall through, whichever limit is taken: their gaps and impacts are at a
/// jump of the motion with the data, as in a box that is exactly as wide as a row of discs. The run has taken the limit
/// in which they are open (methods/contact_laws/group_rest.h (4)).
struct OpenWedge {
  double t = 0;               ///< [s]
  std::vector<int> contacts;  ///< numbers of the contacts, ascending
};

/// The step in which a run leaves its region, and which is not part of the run. Times count from the begin of that
/// step. If `inside` and `outside` are equal, v jumps there.
struct RegionExit {
  int function = -1;       ///< psi_k; -1: it has stayed there
  double inside = 0;       ///< [s], before the border
  double outside = 0;      ///< [s], after the border
  double psi_inside = 0;   ///< sigma_k psi_k before the border, in the accuracy of an interpolation
  double psi_outside = 0;  ///< the same after it, negative
};

/// The result of a run.
struct Solution {
  Status status = Status::success;  ///< how the run ended
  std::string message;              ///< why it stopped early; empty on success
  FailureReason reason;             ///< the same as data, where a verdict depends on it
  double t = 0;                     ///< time that was reached [s]
  Vector q;                         ///< n_q, coordinates there; the clock, if there is one, is the last entry
  Vector v;                         ///< n_q, velocities there, the left limit

  Matrix dq;  ///< n_q x Settings::sensitivities, derivatives of q through all switches; empty if none were requested
  Matrix dv;  ///< the same of v

  RegionExit exit;  ///< of a run that Settings::stays_in_region

  Counters counters;       ///< the work of the run
  double own_seconds = 0;  ///< CPU or wall time [s] that a method in another process measured itself; 0: not measured
  std::vector<Event> events;               ///< in the order of time; empty for Recording::final_state
  std::vector<ContactMode> initial_modes;  ///< n_c, after t = 0; empty if the method has no modes
  std::vector<Sample> samples;             ///< filled for Recording::grid and motion
  Motion motion;                           ///< filled for Recording::motion, if the method supports it

  /// Residuals of the method's own equations, evaluated again after every step; filled if the run was audited.
  std::vector<Residual> residuals;
  double max_residual() const;  ///< the largest of them; -1 without an audit

  std::vector<CapturedGroup> captures;  ///< in the order of time, whether events are recorded or not
  std::vector<OpenWedge> wedges;        ///< the first for each set of contacts that has one of no wedge before
  double captured_height() const;       ///< sum over the captures [m]
  double captured_speed() const;        ///< sum over the captures [m/s]
  void cut_groups(double t_end);        ///< removes captures and wedges after `t_end` [s]

  bool succeeded() const { return status == Status::success; }  ///< The end time was reached.
};

/// Whether a run ends here, early and with success, after a step: its events and initial modes so far, and the modes of
/// all contacts after the step.
using EndsRun = std::function<bool(const Solution& so_far, std::span<const ContactMode> modes)>;

/// Ends the `solution`, a successful run of `problem`, with Status::infeasible if the bound F of a friction element
/// became negative, so that it has no motion from there on. The element's coordinate z, problem.h (8), has risen then:
/// it is positive at the end, or an event tells that the element opened, or that z falls on its support. With the
/// events, no time is missed. With Status::inner_solver_failed if a lever has turned (derivatives/rolling_friction.h):
/// the method has found the force of a contact without that of its friction element.
/// @param h  fixed step length of the method: within two steps F may move z, z' < 4 h |F|; 0: it locates events
void fail_where_bound_is_negative(const Problem& problem, double h, Solution& solution);

/// Ends the `solution`, a run of `problem`, with Status::infeasible if a varying friction coefficient, problem.h (9),
/// is not positive at an event, a grid point or the end. A run that failed keeps its state; its message says so if the
/// coefficient is less than a thousandth of that at the start.
void fail_where_friction_is_not_positive(const Problem& problem, Solution& solution);

}  // namespace ricochet
