#pragma once

#include <Eigen/LU>
#include <optional>

#include "problems/problem.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// Part of the largest pivot below which A may be singular. Pivots are squares of Jacobians, whose own small numbers,
/// as the angle of a rod that lies flat, are errors of the integration.
constexpr double kSingular = kLawRounding;

/// Equations A x = b for contact forces or impulses, A = R' M^-1 C, n x n. Redundant contacts, as both ends of a rod
/// that lies flat and sticks, make A singular: the motion M^-1 C x may be determined all the same, its division among
/// them is not. Rows and unknowns are scaled by s_r = (R' M^-1 R)_rr^(-1/2), so that neither the units of a constraint
/// nor a change of all units decides what is singular.
class ForceEquations {
 public:
  enum class Singular { divide, refuse };  ///< the second saves the time

  /// @param A  n x n; @param diagonal  n, of R' M^-1 R, > 0; @param singular  whether solve() gives what a singular A
  ///   leaves
  ForceEquations(const Matrix& A, const Vector& diagonal, Singular singular = Singular::divide);

  /// The least x where A is singular, in the norm sum_r x_r^2 / s_r^2.
  /// @param b_size  n, sizes of the terms of b
  /// @return nothing where A x = b has no solution, or A is singular and refused
  std::optional<Vector> solve(const Vector& b, const Vector& b_size) const;

  /// Differences of solutions, n x (n - rank); no column where A is regular.
  const Matrix& null_space() const { return null_space_; }

  /// Whether x_r is the same in all solutions.
  bool determines(Eigen::Index r) const;

  /// Whether all solutions leave the same motion. @param effect  m x n, M^-1 C or a product with it that tells motions
  /// apart, each row divided by the size that it has for x = s
  bool determines_motion(const Matrix& effect) const;

 private:
  const Vector s_;
  const Matrix A_;  // scaled
  Eigen::FullPivLU<Matrix> lu_;
  Matrix pseudo_inverse_, null_space_;
};

}  // namespace ricochet::reference
