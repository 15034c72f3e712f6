#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// Newton's equations K dx = -r of a step whose contacts are redundant, four corners on a plane or both ends of a rod
/// that stick: K is singular, and forces that balance each other may be added to any solution. Of all solutions the one
/// with the smallest forces is taken,
///
///   minimise ||S (x + dx)||   subject to   K dx = -r,   S: the forces among the unknowns.                     (1)
///
/// With N a basis of the null space of K it is
///
///   dx = -(I - R) K^- r - R x,   R = N (S N)^+ S,   K K^- K = K   (2),
///
/// for null vectors that consist of forces: M is regular, so forces in balance move nothing. Rows and columns of K have
/// units of their own, masses and inertias among them: its rank is determined after all have been scaled to entries of
/// one.
class RedundantSystem {
 public:
  /// Relative size up to which pivots are zero; while Newton's method converges, rows are not yet dependent.
  static constexpr double kRank = 1e-11;

  /// @param force_rows  of the unknowns that are forces
  RedundantSystem(const Matrix& K, const std::vector<int>& force_rows);

  const Matrix& pseudo_inverse() const { return pseudo_inverse_; }  ///< (I - R) K^-
  const Matrix& to_smallest() const { return to_smallest_; }        ///< R

  /// Whether K, with the inverse that a factorisation gave, is singular to rounding.
  static bool is_singular(const Matrix& K, const Matrix& inverse) {
    const double condition = K.cwiseAbs().colwise().sum().maxCoeff() * inverse.cwiseAbs().colwise().sum().maxCoeff();
    return !(condition < kSingular) && is_singular_in_all_units(K, inverse);
  }

 private:
  static bool is_singular_in_all_units(const Matrix& K, const Matrix& inverse);

  static constexpr double kSingular = 1e14;  // condition number; masses and lengths of many orders stay below

  Matrix pseudo_inverse_, to_smallest_;
};

}  // namespace ricochet
