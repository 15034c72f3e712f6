#pragma once

#include "problems/derivatives/smooth_function.h"
#include "problems/problem.h"

namespace ricochet {

/// The symmetric matrix A with its negative eigenvalues replaced by 0.
Matrix positive_part(const Matrix& A);

/// The convex part of the Hessian of a cost L with the residuals rho of its squares, L = rho' rho + rest:
///
///   2 rho_x' rho_x + P(rest_xx),   rest_xx = L_xx - 2 rho_x' rho_x - sum_k 2 rho_k (rho_k)_xx,             (1)
///
/// where P is positive_part(). The first term is that of Gauss and Newton. It is convex also where a
/// residual is not linear, and P(L_xx) would have lost a part of it.
class ConvexHessian {
 public:
  /// @param cost, residuals  must outlive this object; residuals of the same inputs, without outputs for none
  ConvexHessian(const SmoothFunction& cost, const SmoothFunction& residuals);

  /// (1) at x. @param x  n_inputs
  const Matrix& at(const double* x);

 private:
  const SmoothFunction& cost_;
  const SmoothFunction& residuals_;
  Matrix of_, part_;  // the last rest_xx, and P of it
  Matrix rest_, result_, J_, curvature_;
  Vector rho_;
};

}  // namespace ricochet
