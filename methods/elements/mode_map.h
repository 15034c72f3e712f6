#pragma once

#include <list>
#include <vector>

#include "methods/elements/active_set.h"
#include "problems/solution.h"

namespace ricochet {

/// Accelerations and forces as functions of the state, for one set of modes in which all of them are affine: M and the
/// derivatives of f = f_v + B_u u are constant, closed contacts are affine and do not turn. With the columns
///
///   R = [J_n closed, J_t held],   C = [J_n - mu J_t along, J_t held]
///
/// of the unknown forces lambda (ActiveSet), C without the clock, and s the accelerations R' w that the laws ask for,
///
///   M w = f(q, v) + C lambda,   R' w = s                                                                      (1)
///
/// gives
///
///   w      = A_0 + A_q (q - q_r) + A_v (v - v_r) + B s,      B   = M^-1 C (R' M^-1 C)^-1                       (2)
///   lambda = L_0 + L_q (q - q_r) + L_v (v - v_r) + L_s s,    L_s = (R' M^-1 C)^-1.                             (3)
///
/// (q_r, v_r) is an initial state of the problem, where f is small; with all coordinates zero a stiff spring could make
/// it large. Where terms of (2) cancel up to rounding, the result is set to zero, so that nothing moves across a
/// contact.
struct ModeMap {
  /// @param q, v  (q_r, v_r)
  ModeMap(const Problem& problem, const ActiveSet& active, const Vector& q, const Vector& v);

  std::vector<ContactMode> modes;
  std::vector<int> facets;
  Vector u;                  ///< the control, which may change from step to step of a plan
  bool exists = false;       ///< false: the equations are not affine, or the forces are not unique
  bool is_constant = false;  ///< A_q = A_v = 0: motion along parabolas
  Vector q_r, v_r;           ///< n_q
  Vector A0, L0;             ///< n_q, n_rows of the active set
  Matrix Aq, Av, Lq, Lv;     ///< n_q or n_rows x n_q
  Matrix B, Ls;              ///< n_q or n_rows x n_rows
  Matrix R;                  ///< n_q x n_rows

 private:
  void set(const Problem& problem, const ActiveSet& active);
};

/// The maps of the mode sets that have occurred in runs. All have the initial state of the first run as (q_r, v_r), so
/// that a map is the same whichever run makes it.
class ModeMaps {
 public:
  ModeMaps(const Problem& problem, Counters& counters)
      : problem_(problem), counters_(counters), q_r_(problem.info().q0), v_r_(problem.info().v0) {}

  /// Null if (2) and (3) do not apply, so that Newton's method is needed. Valid until the next call.
  const ModeMap* of(const ActiveSet& active);

 private:
  const Problem& problem_;
  Counters& counters_;
  const Vector q_r_, v_r_;
  std::list<ModeMap> kept_;  // they do not move
};

}  // namespace ricochet
