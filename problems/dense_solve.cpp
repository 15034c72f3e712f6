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

CholeskyFactors::CholeskyFactors(const Matrix& A) : llt_(A) {}

Vector CholeskyFactors::solve(const Vector& b) const {
  return llt_.solve(b);
}

Matrix CholeskyFactors::solve_columns(const Matrix& B) const {
  return llt_.solve(B);
}

}  // namespace ricochet
