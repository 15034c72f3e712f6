#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "problems/motion.h"
#include "problems/problem.h"

namespace ricochet {

enum class Status {
  success,
  infeasible,  ///< the discrete equations of a step have no solution, or none was found; the message says which
  inner_solver_failed,  ///< Newton, linear algebra or a complementarity solver gave up
  step_limit,
  time_limit,
  non_finite,
};

const char* to_string(Status status);

/// Work, counted in the same way by every method.
struct Counters {
  std::int64_t steps = 0;                 ///< simulation steps accepted
  std::int64_t elements = 0;              ///< Runge-Kutta steps accepted (finite elements, internal steps)
  std::int64_t force_evaluations = 0;     ///< f_v + B_u u
  std::int64_t jacobian_evaluations = 0;  ///< derivatives of f_v, M, J_n at one point
  std::int64_t mass_factorizations = 0;
  std::int64_t matrix_factorizations = 0;  ///< of Newton matrices
  std::int64_t linear_solves = 0;          ///< with a factorised Newton matrix or mass matrix
  std::int64_t complementarity_solves = 0;
  std::int64_t inner_iterations = 0;  ///< Newton iterations
  std::int64_t pivots = 0;            ///< of complementarity solvers
  std::int64_t events = 0;
};

/// What a contact does between two events. In the plane slip has a sign, that of the slip velocity; in space it has a
/// direction that may turn, and on a polygon in place of the friction disc a vertex or an edge that carries the force.
enum class ContactMode : std::uint8_t {
  open,
  closed,
  stick,
  slip_positive,
  slip_negative,
  slip,
  vertex_slip,
  edge_slip
};

/// "closed" is a contact without friction.
const char* to_string(ContactMode mode);

inline bool is_closed(ContactMode mode) {
  return mode != ContactMode::open;
}
inline bool is_slipping(ContactMode mode) {
  return mode >= ContactMode::slip_positive;
}
/// Sign of the slip velocity in the plane; 0 for every other mode.
inline int slip_sign(ContactMode mode) {
  return mode == ContactMode::slip_positive ? 1 : mode == ContactMode::slip_negative ? -1 : 0;
}

/// The mode of a contact that slips with velocity v_t (n_t components), not zero; "closed" without tangent directions.
inline ContactMode slip_mode(int n_t, const double* v_t) {
  if (n_t == 0) return ContactMode::closed;
  if (n_t == 2) return ContactMode::slip;
  return v_t[0] > 0 ? ContactMode::slip_positive : ContactMode::slip_negative;
}

/// facet_change: on a polygon in place of the friction disc another vertex or edge carries the force of a slipping
/// contact
enum class EventKind { impact, detach, slip_to_stick, stick_to_slip, slip_reversal, facet_change };

const char* to_string(EventKind kind);

/// What a contact does at an instant, if anything. @param has_impulse  it gets one; @param slip_ended  its slip did, and
/// may go on along the same mode
std::optional<EventKind> event_kind(ContactMode before, ContactMode after, bool has_impulse, bool slip_ended = false);

/// A change of the active set. Left and right limits differ at an impact only.
struct Event {
  double t = 0;
  EventKind kind = EventKind::impact;
  int contact = -1;
  Vector q, v_minus, v_plus;
  Vector Lambda_n;                 ///< n_c [N s]; zero unless an impact
  Vector Lambda_t;                 ///< n_lambda_t [N s]
  std::vector<ContactMode> modes;  ///< n_c, of all contacts behind the event; empty from methods that know none
  Vector dt;                       ///< derivatives of t, as Solution::dq
};

/// State at a grid point, both limits of the velocity.
struct Sample {
  double t = 0;
  Vector q, v_minus, v_plus;
};

/// Largest relative residual of one equation of a method over a run, and where it was found.
struct Residual {
  std::string name, formula;
  double value = 0;
  double t = 0;                 ///< start of the step [s]
  int contact = -1;             ///< -1: no contact's
  std::int64_t impossible = 0;  ///< points at which the equation has no solution whatever its unknowns; not in `value`
};

/// What remains of a run.
struct Solution {
  Status status = Status::success;
  std::string message;  ///< why the run stopped early; empty on success
  double t = 0;         ///< time that was reached [s]
  Vector q, v;          ///< n_q, state there; v is the left limit. The clock, where there is one, is the last entry

  Matrix dq, dv;  ///< n_q x Settings::sensitivities: derivatives of q and v, through all switches

  Counters counters;
  double own_seconds = 0;  ///< CPU or wall time of the run as a method in another process took it [s]; 0: by our clock
  std::vector<Event> events;
  std::vector<ContactMode> initial_modes;  ///< n_c, behind t = 0; empty from methods that know none
  std::vector<Sample> samples;             ///< filled on Recording::grid and motion
  Motion motion;                           ///< filled on Recording::motion; empty from methods that know none

  /// The method's own equations, evaluated afresh after every step: filled when the run was audited.
  std::vector<Residual> residuals;
  double max_residual() const;  ///< the largest of them; -1 without an audit

  bool succeeded() const { return status == Status::success; }
};

}  // namespace ricochet
