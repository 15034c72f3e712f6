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
    lu_.compute(A);
    inverse_ = lu_.permutationP() * Matrix::Identity(A.rows(), A.cols());
    lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(inverse_);
    lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(inverse_);
    return inverse_;
  }

 private:
  Eigen::PartialPivLU<Matrix> lu_;
  Matrix inverse_;
};

}  // namespace ricochet
