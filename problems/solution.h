#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "problems/motion.h"
#include "problems/problem.h"

/// @file
/// What a run leaves: Solution, its events, counters and status.

namespace ricochet {

/// How a run ended. What is no success comes with a message.
enum class Status {
  success,     ///< the end time was reached
  infeasible,  ///< the discrete equations of a step have no solution, or none was found; the message says which
  inner_solver_failed,  ///< Newton, linear algebra or a complementarity solver gave up
  step_limit,           ///< more steps or events than a method takes
  time_limit,           ///< Settings::time_limit was over
  non_finite,           ///< a state or a force that is no number
};

/// "success", "inner_solver_failed" and so on: the enumerator of `status`, as files and tables have it.
const char* to_string(Status status);

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

/// What a contact does between two events. In the plane slip has a sign, that of the slip velocity v_t [m/s]; in space it
/// has a direction that may turn, and on a polygon in place of the friction disc a vertex or an edge that carries the
/// force.
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

/// "open", "stick", "slip+" and so on: the words for `mode` in files and tables.
const char* to_string(ContactMode mode);

/// A contact of this `mode` touches.
inline bool is_closed(ContactMode mode) {
  return mode != ContactMode::open;
}
/// A contact of this `mode` slips, in the plane or in space.
inline bool is_slipping(ContactMode mode) {
  return mode >= ContactMode::slip_positive;
}
/// Sign of the slip velocity of a `mode` in the plane; 0 for every other one.
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

/// What happens to a contact at an instant.
enum class EventKind {
  impact,         ///< it gets an impulse: v jumps
  detach,         ///< it opens
  slip_to_stick,  ///< its slip velocity becomes zero and stays there
  stick_to_slip,  ///< its friction force leaves the cone
  slip_reversal,  ///< its slip velocity goes through zero
  facet_change  ///< on a polygon in place of the friction disc another vertex or edge carries its force while it slips
};

/// "impact", "slip_to_stick" and so on: the enumerator of `kind`, as files and tables have it.
const char* to_string(EventKind kind);

/// What a contact does at an instant, if anything: it goes from the mode `before` to the mode `after`.
/// @param before, after  modes to the left and to the right of the instant
/// @param has_impulse    it gets an impulse
/// @param slip_ended     its slip did end, and may go on along the same mode
std::optional<EventKind> event_kind(ContactMode before, ContactMode after, bool has_impulse, bool slip_ended = false);

/// A change of the active set. Left and right limits differ at an impact only.
struct Event {
  double t = 0;                        ///< [s]
  EventKind kind = EventKind::impact;  ///< what happens
  int contact = -1;                    ///< to which contact, from 0
  Vector q;                            ///< n_q, state there
  Vector v_minus;                      ///< n_q, left limit of v
  Vector v_plus;                       ///< n_q, right limit of v
  Vector Lambda_n;                     ///< n_c [N s], normal impulses; zero unless an impact
  Vector Lambda_t;                     ///< n_lambda_t [N s], friction impulses, as ContactInfo::tangent_index counts
  std::vector<ContactMode> modes;      ///< n_c, of all contacts behind the event; empty from methods that know none
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
  std::string name;             ///< of the equation, "complementarity"
  std::string formula;          ///< as text, with the number of its publication
  double value = 0;             ///< the largest of the run, relative
  double t = 0;                 ///< start of the step [s]
  int contact = -1;             ///< -1: no contact's
  std::int64_t impossible = 0;  ///< points at which the equation has no solution whatever its unknowns; not in `value`
};

/// What remains of a run.
struct Solution {
  Status status = Status::success;  ///< how the run ended
  std::string message;              ///< why it stopped early; empty on success
  double t = 0;                     ///< time that was reached [s]
  Vector q;                         ///< n_q, coordinates there; the clock, where there is one, is the last entry
  Vector v;                         ///< n_q, velocities there, the left limit

  Matrix dq;  ///< n_q x Settings::sensitivities, derivatives of q through all switches; empty when none were asked for
  Matrix dv;  ///< the same of v

  Counters counters;       ///< the work of the run
  double own_seconds = 0;  ///< CPU or wall time of the run as a method in another process took it [s]; 0: by our clock
  std::vector<Event> events;               ///< in the order of time; empty on Recording::final_state
  std::vector<ContactMode> initial_modes;  ///< n_c, behind t = 0; empty from methods that know none
  std::vector<Sample> samples;             ///< filled on Recording::grid and motion
  Motion motion;                           ///< filled on Recording::motion; empty from methods that know none

  /// The method's own equations, evaluated afresh after every step: filled when the run was audited.
  std::vector<Residual> residuals;
  double max_residual() const;  ///< the largest of them; -1 without an audit

  bool succeeded() const { return status == Status::success; }  ///< The end time was reached.
};

}  // namespace ricochet
