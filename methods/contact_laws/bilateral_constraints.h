#pragma once

#include "methods/linear_algebra/small_lu.h"
#include "problems/problem.h"

namespace ricochet {

/// The bilateral constraints of a problem at one instant, eliminated. They turn a velocity or an acceleration x into
///
///   x + W G m   with   G' (x + W G m) + b = 0                                            (1)
///   m = -S^-1 (G' x + b),   S = G' W G                                                   (2)
///
/// G: their Jacobian, n_q x n_bilateral; m: their impulses or forces; W: M^-1, or the inverse of the iteration matrix
/// of a method; b: 0 for velocities, v' (grad^2 f_c) v for accelerations. With b = 0 this is the projection P x, P = I
/// - W G S^-1 G'. The response W d to an impulse d becomes P W d: P W in place of W keeps the constraints.
class BilateralConstraints {
 public:
  explicit BilateralConstraints(const Problem& problem);

  /// Takes G from a packed J_n. @param solve  makes W x of a column x in place
  /// @return false when S is singular: the constraints depend on each other
  template <class Solve>
  bool prepare(const double* packed_J_n, Solve solve) {
    set_jacobian(packed_J_n);
    for (Eigen::Index k = 0; k < G_.cols(); ++k) {
      WG_.col(k) = G_.col(k);
      if (info_.clock >= 0) WG_(info_.clock, k) = 0;  // no force acts on the clock
      solve(WG_.col(k));
    }
    return set_delassus();
  }

  /// (1), (2). @param b  n_c, null for 0; @param m  n_c; entries of unilateral contacts are left alone
  void impose(Eigen::Ref<Vector> x, const double* b, Eigen::Ref<Vector> m);

  /// G' x, n_c; entries of unilateral contacts are left alone.
  void velocities(const Vector& x, Vector& rates) const;
  /// Largest violation of G' x + b = 0, relative to its terms and to what m contributes to them.
  double residual(const Vector& x, const double* b, const Vector& m) const;

 private:
  void set_jacobian(const double* packed_J_n);
  bool set_delassus();

  const ProblemInfo& info_;
  Matrix G_, WG_, S_, S_inverse_;
  Vector rates_, multipliers_;
  SmallLu inverse_;
};

}  // namespace ricochet
