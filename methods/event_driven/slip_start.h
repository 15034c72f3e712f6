#pragma once

#include <vector>

#include "methods/modes/event_functions.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The first moments of slip in space from rest. With u = J_t' v = s d, |d| = 1, d_perp = (-d_2, d_1), the friction of a
/// contact turns the direction by
///
///   s d_perp' d' = d_perp' w(d),   w = u' the slip acceleration with the friction of the direction d     (1)
///
/// which is singular at s = 0: of all solutions of (1) one is regular, with d_perp' w(d) = 0 there. Where slip begins at
/// the edge of the cone, w(d) = 0 there, too, so d(0) is opposite to the force of the last moment of stick. The next term of
/// (1), with w = b(t) - W mu lambda_n d, determines how fast friction turns and slip grows:
///
///   sigma d(0) = b'(0) - W (mu lambda_n d)'(0),   s = sigma t^2 / 2 + O(t^3)                              (2)
///
/// The regular solution is smooth, so collocation by Radau IIA with five stages follows it, whose stages have angles
/// phi_i of the directions among the unknowns:
///
///   q_i = q + c_i h v + h^2 sum_j (A^2)_ij a_j,   v_i = v + h sum_j A_ij a_j,   a_i = a(q_i, v_i, phi_i)      (3)
///   0 = d_perp(phi_i)' u(q_i, v_i) / h                                                                  (4)
///
/// (3) is a fixed point for short steps. Newton's method on (4) uses the derivatives of a_i by phi_i and A alone. Both
/// are repeated together. The equation (4) is one of the velocity across d, which is nearly linear in phi also where s is tiny;
/// the angle between u and d is not.
class SlipStart {
 public:
  /// All references must outlive this object.
  SlipStart(const Problem& problem, ModeDynamics& dynamics, EventFunctions& functions);

  /// One step of length h [s]. @param contacts  that slip, with a direction held by the dynamics
  /// @param q, v  in: left end, out: right end @param angles  by contact, at the left end (or a guess), out: at the right
  /// @return false where the iteration does not converge or a contact slips against its direction
  bool take(double h, const std::vector<int>& contacts, Vector& q, Vector& v, Vector& angles);
  /// The angles at the left end of the last step that converged, extrapolated from those of its stages.
  const Vector& first_angles() const { return first_angles_; }
  /// Holds the directions of these angles.
  void hold(const std::vector<int>& contacts, const Vector& angles);
  /// Largest part of the slip velocity that friction changes within h [s] at (q, v), with directions held: explicit steps
  /// are stable up to a few of it. Infinite where a contact rests.
  double stiffness(double h, const std::vector<int>& contacts, const Vector& q, const Vector& v, const Vector& angles);

 private:
  bool accelerate(Eigen::Index stage, const std::vector<int>& contacts);

  const Problem& problem_;
  ModeDynamics& dynamics_;
  EventFunctions& functions_;
  const ButcherTableau tableau_;
  const Matrix A2_;
  Vector to_left_;                 // weights of the stages in the extrapolation to the left end
  Matrix q_, v_, a_, next_, phi_;  // n_q x stages; contacts x stages
  std::vector<Matrix> a_phi_;      // by contact: n_q x stages
  Vector first_angles_, slip_;
};

}  // namespace ricochet
