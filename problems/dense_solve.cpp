#include "problems/dense_solve.h"

#include <Eigen/LU>
#include <Eigen/QR>

namespace ricochet {

Vector least_squares(const Matrix& A, const Vector& b) {
  return A.completeOrthogonalDecomposition().solve(b);
}

Matrix pseudo_inverse(const Matrix& A) {
  return A.completeOrthogonalDecomposition().pseudoInverse();
}

Matrix solve_full_pivoting(const Matrix& A, const Matrix& B) {
  return A.fullPivLu().solve(B);
}

Matrix solve_partial_pivoting(const Matrix& A, const Matrix& B) {
  return A.partialPivLu().solve(B);
}

Matrix solve_consistent(const Matrix& A, const Matrix& B) {
  constexpr double kSingular = 1e-14;  // reciprocal condition number
  const Eigen::PartialPivLU<Matrix> lu(A);
  if (lu.rcond() > kSingular) return lu.solve(B);
  const Vector size = A.cwiseAbs().rowwise().maxCoeff();
  const Vector scale = (size.array() > 0).select(size.cwiseInverse(), 1);
  return solve_full_pivoting(scale.asDiagonal() * A, scale.asDiagonal() * B);
}

CholeskyFactors::CholeskyFactors(const Matrix& A) : llt_(A) {}

Vector CholeskyFactors::solve(const Vector& b) const {
  return llt_.solve(b);
}

Matrix CholeskyFactors::solve_columns(const Matrix& B) const {
  return llt_.solve(B);
}

}  // namespace ricochet
