#pragma once

#include <Eigen/Cholesky>

#include "problems/problem.h"

namespace ricochet {

// Eigen's dense decompositions for common right-hand sides, compiled once: a file that instantiates its own compiles
// three to ten seconds longer. Names differ because Eigen's expressions would match two overloads.

Vector least_squares(const Matrix& A, const Vector& b);        ///< the shortest x that minimises |A x - b|
Matrix pseudo_inverse(const Matrix& A);                        ///< A^+, by the same decomposition
Matrix solve_full_pivoting(const Matrix& A, const Matrix& B);  ///< X with A X = B
Matrix solve_partial_pivoting(const Matrix& A, const Matrix& B);
/// A solution X of consistent equations A X = B, where A may be singular up to rounding. Partial pivoting is used; if A
/// is singular, full pivoting with scaled rows.
Matrix solve_consistent(const Matrix& A, const Matrix& B);

/// Cholesky decomposition of a symmetric matrix, such as M(q).
class CholeskyFactors {
 public:
  explicit CholeskyFactors(const Matrix& A);
  Vector solve(const Vector& b) const;
  Matrix solve_columns(const Matrix& B) const;

 private:
  Eigen::LLT<Matrix> llt_;
};

}  // namespace ricochet
