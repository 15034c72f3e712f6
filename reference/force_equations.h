#pragma once

#include <optional>

#include "problems/dense_solve.h"
#include "problems/problem.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// Fraction of the largest pivot below which A may be singular. Pivots are squares of entries of Jacobians, whose small
/// values, as the angle of a rod that lies flat, are errors of the integration.
constexpr double kSingular = kLawRounding;

/// Equations A x = b for contact forces or impulses, A = R' M^-1 C, n x n. Redundant contacts, such as both ends of a
/// rod that lies flat and sticks, make A singular. The motion M^-1 C x may still be determined, but the division of x
/// among the contacts is not. Rows and unknowns are scaled by s_r = (R' M^-1 R)_rr^(-1/2), so that the units of a
/// constraint do not decide what is singular.
class ForceEquations {
 public:
  enum class Singular { divide, refuse };  ///< `refuse` saves time

  /// @param A  n x n; @param diagonal  n, of R' M^-1 R, > 0; @param singular  whether solve() returns a solution for a
  ///   singular A
  ForceEquations(const Matrix& A, const Vector& diagonal, Singular singular = Singular::divide);

  /// The solution; if A is singular, the least one in the norm sum_r x_r^2 / s_r^2.
  /// @param b_size  n, sizes of the terms of b
  /// @return nothing if A x = b has no solution, or if A is singular and refused
  std::optional<Vector> solve(const Vector& b, const Vector& b_size) const;

  /// Null space of A, n x (n - rank); no column if A is regular.
  const Matrix& null_space() const { return null_space_; }

  /// Whether x_r is the same in all solutions.
  bool determines(Eigen::Index r) const;

  /// Whether all solutions give the same motion. @param effect  m x n, M^-1 C or a product with it that distinguishes
  /// motions, each row divided by its size for x = s
  bool determines_motion(const Matrix& effect) const;

 private:
  const Vector s_;
  const Matrix A_;  // scaled
  FullPivotingFactors lu_;
  Matrix pseudo_inverse_, null_space_;
};

}  // namespace ricochet::reference
