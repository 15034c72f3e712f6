#pragma once

#include <Eigen/Cholesky>

#include "problems/problem.h"

namespace ricochet {

// Eigen's dense decompositions with the right-hand sides that most callers have, compiled here once: a file that has
// its own takes three to ten seconds longer. Names differ where Eigen's expressions would fit two overloads.

Vector least_squares(const Matrix& A, const Vector& b);        ///< the shortest of all x with the least |A x - b|
Matrix pseudo_inverse(const Matrix& A);                        ///< A^+, by the same decomposition
Matrix solve_full_pivoting(const Matrix& A, const Matrix& B);  ///< X with A X = B
Matrix solve_partial_pivoting(const Matrix& A, const Matrix& B);
/// Some X with A X = B, where A may be singular to rounding and the equations agree: with partial pivoting, and where A
/// is singular with full pivoting, its rows scaled.
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
