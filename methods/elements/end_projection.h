#pragma once

#include <Eigen/Cholesky>

#include "methods/elements/active_set.h"
#include "methods/elements/stage_coefficients.h"
#include "methods/linear_algebra/small_lu.h"

namespace ricochet {

/// Equations of the closed contacts for velocities and forces at one state, which the functions of EndProjection share.
struct EndSystem {
  Eigen::Index n = 0;         ///< columns of R, C
  bool is_constant = false;   ///< the system holds for this active set
  Matrix R, MC;               ///< n_q x n: R of (10), M^-1 C
  Matrix system, inverse;     ///< R' M^-1 C
  Matrix directions;          ///< 2 x closed contacts: d, zero where nothing slips
  Matrix M;                   ///< n_q x n_q
  Eigen::LLT<Matrix> llt;     ///< of M
  Vector lambda_n, lambda_t;  ///< n_c, n_lambda_t: the forces (11)

  // Scratch of one function at a time.
  SmallLu lu;
  Vector rates, impulses, f, J_n, J_t, gap, v;
  Matrix T;
};

/// Velocity and forces at the right end of an element. P of (5) in stage_equations.h is the identity, unless a closed
/// contact is curved, or a bounce is closed (below). (4) alone leaves a velocity of O(h^n_s) across it, caused by
/// errors of the forces. P, at q_1, removes it by impulses of all closed contacts, along the directions of their
/// forces:
///
///   P = I - M^-1 C (R' M^-1 C)^-1 R',   R = [J_n closed, J_t held],   C = [J_n - mu J_t d slipping, else as R]    (10)
///
/// with d the direction of slip, or `along`. The force of the last stage is of order n_s - 1 only. The forces at the
/// right end decide when a contact breaks or begins to slip. They are those that keep q_1, v_1 on the contacts, as
/// accurate as the state:
///
///   M w = f_v + B_u u + C lambda,   R' w + (d/dt R') v_1 = 0.                                                     (11)
///
/// For tableaus without a stage at the right end, q_1 is off the curve already: P = I, and the forces are extrapolated
/// from the stages. Affine contacts, however, hold at q_1, v_1, and (11) is far more accurate there: stage forces have
/// order n_s, and (11) reduces the errors of the event times of P4b with gauss:4 to a thousandth to a millionth. (11)
/// is one system of all closed contacts; where more than 64 coordinates have no closed form these forces are
/// extrapolated, too. If a contact moves by itself, R contains the clock and C does not.
///
/// An element that closes a bounce (methods/fesd/capture.h) starts with a velocity across its contact. A stage at the right
/// end takes it away; Gauss leaves R(inf) v = +-v there, which would open the contact again. So P acts there, too.
class EndProjection {
 public:
  EndProjection(const Problem& problem, const StageTableau& tableau, const ActiveSet& active, Counters& counters);

  /// P of (5) is not the identity.
  bool applies_to(const Element& e) const { return moves_along_curves() || (e.closes_bounce && keeps_contacts()); }
  /// (11) gives the forces at the right end.
  bool gives_forces() const { return moves_along_curves() || keeps_contacts(); }

  /// Makes room in a new system, and for another active set.
  void prepare(EndSystem& s) const;
  void resize(EndSystem& s) const;

  /// R, M^-1 C and the inverse of R' M^-1 C at q, v.
  void linearize(const Vector& q, const Vector& v, const Element& e, EndSystem& s) const;
  /// v_1 of (5), by (10). Linearizes at q_1 and the velocity before.
  void project(Element& e, EndSystem& s) const;
  /// Projects variations of q_1, v_1 with the system of project(): R' dv_1 + dR' v_1 = 0. Variations of C are left
  /// out, since the impulses are O(h^n_s). @param dq, dv  n_q x 2
  void project_variations(const Element& e, const Matrix& dq, Matrix& dv, EndSystem& s) const;
  /// The forces (11) at q, v where the system was linearized.
  void set_forces(const Vector& q, const Vector& v, EndSystem& s) const;
  /// Element::end_lambda_n, end_lambda_t by (11).
  void set_end_forces(Element& e, EndSystem& s) const;
  /// The same from the stages, where (11) does not give them.
  void set_stage_end_forces(Element& e) const;

 private:
  bool moves_along_curves() const { return tableau_.ends_with_stage && active_.has_curved(); }
  bool keeps_contacts() const { return keeps_affine_ && !active_.empty() && !active_.has_curved(); }
  static void take_away_rates(EndSystem& s, Eigen::Ref<Vector> x);

  const Problem& problem_;
  const StageTableau& tableau_;
  const ActiveSet& active_;
  Counters& counters_;
  const int last_stage_;
  const bool keeps_affine_;  // there is no stage at the right end, and (11) is a small system
};

}  // namespace ricochet
