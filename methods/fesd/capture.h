#pragma once

#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// Effect of a closed element on a velocity v+ > 0 across its contact (DIFFERENCES.md, open question 2).
///
/// All gaps at the stages are zero, so by q_j = q_0 + h sum_k a_jk v_k, A regular, all stage velocities are, and the
/// stage forces on a mass m under the constant load -m g are
///
///   lambda_j = m (g - (v+ / h) (A^-1 1)_j),                                                                  (1)
///   v_1 = v+ (1 - b' A^-1 1) = R(inf) v+,   q_1 = q_0,                                                       (2)
///
/// R the stability function: 0 for Radau IIA, Radau IA and Lobatto IIIC, (-1)^n_s for Gauss. All lambda_j are >= 0, and
/// the element is a solution of the FESD-J equations, exactly when
///
///   h >= kappa v+ / g,   kappa = max_j (A^-1 1)_j.                                                           (3)
///
/// For collocation, (A^-1 1)_j = (1/c_j) prod_{k != j} (1 - c_j/c_k): v is v+ prod_k (1 - c/c_k), which vanishes at the
/// stages. It is largest at c_1, and for Radau IIA grows like 2 n_s^2 J_1(z)/z = 0.432 n_s^2, z the first zero of J_0.
struct Capture {
  double kappa = 0;  ///< infinity when A is singular: a closed element has no solution then
  double kept = 0;   ///< R(inf), the share of v+ that returns at the right end

  /// Whether the velocity is zero at the right end.
  bool absorbs() const;
  /// Longest time by which FESD-J with elements of length at most h can stop a ball that bounces with restitution e too
  /// early. A capture is tried only where the next flight, 2 v+/g, does not fit into the element. So with (3) v+ <= g h
  /// / max(2, kappa), and the flights that are left out take 2 v+ / (g (1 - e)):
  ///
  ///   t_Z - t_rest <= 2 h / (max(2, kappa) (1 - e)).                                                        (4)
  ///
  /// It holds for tableaus of order >= 2, whose flights are exact.
  double rest_time_bound(double h, double e) const;
};

Capture capture(const ButcherTableau& tableau);

}  // namespace ricochet
