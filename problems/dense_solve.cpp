#include "problems/dense_solve.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

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

Matrix inverse_of(const Matrix& A) {
  return A.inverse();
}

bool is_invertible(const Matrix& A) {
  return A.fullPivLu().isInvertible();
}

PartialPivotingFactors::PartialPivotingFactors(const Matrix& A) : lu_(A) {}

Vector PartialPivotingFactors::solve(const Vector& b) const {
  return lu_.solve(b);
}

Matrix PartialPivotingFactors::solve_columns(const Matrix& B) const {
  return lu_.solve(B);
}

FullPivotingFactors::FullPivotingFactors(const Matrix& A, double threshold) {
  if (threshold > 0) lu_.setThreshold(threshold);
  lu_.compute(A);
}

bool FullPivotingFactors::is_invertible() const {
  return lu_.isInvertible();
}

Eigen::Index FullPivotingFactors::rank() const {
  return lu_.rank();
}

Vector FullPivotingFactors::solve(const Vector& b) const {
  return lu_.solve(b);
}

RankDecomposition::RankDecomposition(const Matrix& A, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition(A.rows(), A.cols());
  decomposition.setThreshold(threshold);
  decomposition.compute(A);
  pseudo_inverse = decomposition.pseudoInverse();
  null_space =
      decomposition.colsPermutation() * decomposition.matrixZ().transpose().rightCols(A.cols() - decomposition.rank());
}

SymmetricEigen::SymmetricEigen(const Matrix& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(A);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}

SingularValues::SingularValues(const Matrix& A) {
  const Eigen::JacobiSVD<Matrix> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  values = svd.singularValues();
  U = svd.matrixU();
  V = svd.matrixV();
}

CholeskyFactors::CholeskyFactors(const Matrix& A) : llt_(A) {}

Vector CholeskyFactors::solve(const Vector& b) const {
  return llt_.solve(b);
}

Matrix CholeskyFactors::solve_columns(const Matrix& B) const {
  return llt_.solve(B);
}

Matrix CholeskyFactors::solve_lower(const Matrix& B) const {
  return llt_.matrixL().solve(B);
}

}  // namespace ricochet
