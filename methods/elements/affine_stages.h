#pragma once

#include "methods/elements/mode_map.h"
#include "methods/elements/stage_coefficients.h"
#include "methods/elements/stage_equations.h"
#include "methods/runge_kutta/diagonal_tableau.h"

namespace ricochet {

/// The stage equations (3), (4), (7) of stage_equations.h in closed form, if a ModeMap gives the accelerations. (4) and
/// (7a) require
///
///   R' w_j = s_j,   s_j = -(A^-1 e)_j / h r_1 - (A^-2 e)_j / h^2 r_2                                          (1)
///
/// r_1: J_n' v_0 of closed contacts, zero if it is rounding, and StageWorkspace::kept_slip of those that stick; r_2:
/// kept_gap of closed contacts. With (1), (2) of stage_equations.h the accelerations are the solution of
///
///   w_j = g_0 + h (A e)_j g_1 + (A^-1 e)_j / h g_2 + (A^-2 e)_j / h^2 g_3 + sum_k (h a_jk A_v + h^2 (A^2)_jk A_q) w_k,
///   g_0 = A_0 + A_q (q_0 - q_r) + A_v (v_0 - v_r),   g_1 = A_q v_0,   g_2 = -B r_1,   g_3 = -B r_2,                           (2)
///
/// and with the eigenvalues l_k of A (diagonal_tableau.h) and z_k = h l_k it splits into systems of n_q unknowns,
///
///   w_j = g_0 + (A^-1 e)_j / h g_2 + (A^-2 e)_j / h^2 g_3 + Re sum_k sigma_jk x_k,
///   (I - z_k A_v - z_k^2 A_q) x_k = A_v (z_k g_0 + g_2 + g_3 / z_k) + A_q (z_k v_0 + z_k^2 g_0 + z_k g_2 + g_3).   (3)
///
/// x_k is the change of the acceleration by the motion within the element, so its rounding is small in short elements.
/// (3) holds for any h: no factors depend on a length.
class AffineStages {
 public:
  AffineStages(const Problem& problem, const StageTableau& tableau, const ActiveSet& active);

  /// Whether the tableau allows (3) and, if contacts are closed, (1).
  bool has_closed_form(bool has_closed) const {
    return tableau_.diagonal && (!has_closed || tableau_.diagonal->inverse.size() > 0);
  }

  /// In: h, q0, v0 of the element and the initial values in the workspace. Out: a, q, v, lambda_n, lambda_t at the
  /// stages. @return false where (3) is singular
  bool solve(const ModeMap& map, const StageEquations& equations, const StageCoefficients& k, Element& e,
             StageWorkspace& work);
  /// The forces (11) of end_projection.h at the right end.
  void set_end_forces(const ModeMap& map, Element& e);

 private:
  void set_forcing(const ModeMap& map, const Element& e, const StageWorkspace& work);
  bool add_changes(const ModeMap& map, double h, Element& e);
  void set_forces(const ModeMap& map, double h, Element& e);
  void set_unconstrained(const ModeMap& map, const double* q, const double* v);
  void distribute(double* lambda_n, double* lambda_t) const;

  const Problem& problem_;
  const StageTableau& tableau_;
  const ActiveSet& active_;
  Matrix g_;                    // n_q x 4: g_0, .., g_3 of (2)
  Vector r1_, r2_, s_;          // n_rows: of (1)
  Vector lambda_;               // n_rows
  bool has_forcing_ = false;    // g_2 or g_3 is not zero
  std::vector<double> system_;  // of (3), real and imaginary parts in turn
};

}  // namespace ricochet
