#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "problems/problem.h"

namespace ricochet {

// Eigen's dense decompositions for common right-hand sides, compiled once: a file that instantiates its own compiles
// three to ten seconds longer. Names differ because Eigen's expressions would match two overloads.

Vector least_squares(const Matrix& A, const Vector& b);        ///< the shortest x that minimises |A x - b|
Matrix pseudo_inverse(const Matrix& A);                        ///< A^+, by the same decomposition
Matrix solve_full_pivoting(const Matrix& A, const Matrix& B);  ///< X with A X = B
Matrix solve_partial_pivoting(const Matrix& A, const Matrix& B);

Matrix inverse_of(const Matrix& A);   ///< A^-1, by partial pivoting
bool is_invertible(const Matrix& A);  ///< to rounding, by full pivoting

/// Decomposition with partial pivoting.
class PartialPivotingFactors {
 public:
  explicit PartialPivotingFactors(const Matrix& A);
  Vector solve(const Vector& b) const;
  Matrix solve_columns(const Matrix& B) const;

 private:
  Eigen::PartialPivLU<Matrix> lu_;
};

/// Decomposition with full pivoting.
class FullPivotingFactors {
 public:
  FullPivotingFactors() = default;
  /// @param threshold  pivots up to this fraction of the largest one count as zero; 0 is Eigen's, some roundings
  explicit FullPivotingFactors(const Matrix& A, double threshold = 0);
  bool is_invertible() const;
  Eigen::Index rank() const;
  Vector solve(const Vector& b) const;

 private:
  Eigen::FullPivLU<Matrix> lu_;
};

/// Complete orthogonal decomposition of a matrix of any rank.
struct RankDecomposition {
  /// @param threshold  pivots up to this fraction of the largest one count as zero
  RankDecomposition(const Matrix& A, double threshold);
  Matrix pseudo_inverse, null_space;  ///< A^+; columns N with A N = 0
};

/// A = vectors diag(values) vectors', symmetric; the smallest value is the first.
struct SymmetricEigen {
  explicit SymmetricEigen(const Matrix& A);
  Vector values;
  Matrix vectors;
};

/// A = U diag(values) V', U and V square; the largest value is the first.
struct SingularValues {
  explicit SingularValues(const Matrix& A);
  Vector values;
  Matrix U, V;
};

/// Cholesky decomposition of a symmetric matrix, such as M(q).
class CholeskyFactors {
 public:
  explicit CholeskyFactors(const Matrix& A);
  Vector solve(const Vector& b) const;
  Matrix solve_columns(const Matrix& B) const;
  Matrix solve_lower(const Matrix& B) const;  ///< L^-1 B with A = L L'

 private:
  Eigen::LLT<Matrix> llt_;
};

}  // namespace ricochet
