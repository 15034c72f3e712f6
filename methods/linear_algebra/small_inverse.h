#pragma once

#include <Eigen/LU>

#include "problems/problem.h"

namespace ricochet {

/// Inverse of a small matrix by LU factorisation with partial pivoting, without allocation when the size stays the
/// same.
class SmallInverse {
 public:
  /// @return A^-1; its entries are not finite when A is singular
  const Matrix& of(const Matrix& A) {
    factorize(A);
    return inverse();
  }

  // The two parts of it, for a matrix whose inverse is not always wanted.
  void factorize(const Matrix& A) { lu_.compute(A); }
  /// The inverse of the factorised matrix.
  const Matrix& inverse() {
    inverse_ = lu_.permutationP() * Matrix::Identity(lu_.rows(), lu_.cols());
    lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(inverse_);
    lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(inverse_);
    return inverse_;
  }
  /// x = A^-1 b of the factorised matrix, more accurate than with the inverse.
  void solve(const Matrix& b, Matrix& x) const { x = lu_.solve(b); }
  /// The same, in place of one column b.
  void solve_in_place(Eigen::Ref<Vector> b) const { b = lu_.solve(b).eval(); }

 private:
  Eigen::PartialPivLU<Matrix> lu_;
  Matrix inverse_;
};

}  // namespace ricochet
