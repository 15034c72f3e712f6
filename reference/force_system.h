#pragma once

#include "problems/problem.h"
#include "problems/small_factors.h"

namespace ricochet::reference {

/// A system A x = b of contact forces that is regular, with rows and columns scaled by the diagonal D of R' M^-1 R,
///
///   (D^-1/2 A D^-1/2) (D^1/2 x) = D^-1/2 b
///
/// as ForceEquations scales it. A matrix whose scaled pivots are below kSingular is not regular.
class ForceSystem {
 public:
  void resize(Eigen::Index n);
  /// Entries of A and of the diagonal, to be filled before factorize().
  Matrix& A() { return A_; }
  Vector& diagonal() { return diagonal_; }
  const Matrix& A() const { return A_; }
  const Vector& diagonal() const { return diagonal_; }
  /// 1 / sqrt(D), after factorize().
  const Vector& scale() const { return scale_; }

  void factorize();
  bool is_regular() const { return is_regular_; }
  /// Solves the scaled system: D^-1/2 b in, D^1/2 x out.
  void solve_scaled(Vector& x) const { factors_.solve(x.data()); }

 private:
  Matrix A_, scaled_;
  Vector diagonal_, scale_;
  PivotedFactors factors_;
  bool is_regular_ = false;
};

}  // namespace ricochet::reference
