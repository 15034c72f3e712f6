#pragma once

#include <vector>

#include "methods/linear_algebra/small_lu.h"
#include "problems/problem.h"

namespace ricochet {

/// LU factorisation of a small square matrix with complete pivoting,
///
///   P A Q = L U,                                                                                            (1)
///
/// and its solves. Pivots that are rounding of the largest one count as zero: of consistent equations with a singular
/// matrix it finds a solution, with zero for the unknowns of these pivots. Of a matrix that is not finite, solutions are
/// NaN. No allocation up to the largest size so far.
class CompletePivotingLu {
 public:
  void factorize(const Eigen::Ref<const Matrix>& A);
  Eigen::Index rank() const { return rank_; }
  /// Replaces B by a solution X of A X = B.
  void solve_in_place(Eigen::Ref<Matrix> B);

 private:
  Eigen::Map<Matrix> lu() { return {lu_.data(), n_, n_}; }

  Eigen::Index n_ = 0, rank_ = 0;
  bool is_finite_ = true;
  std::vector<double> lu_, x_;
  std::vector<Eigen::Index> rows_, columns_;  // exchanged with row and column k
};

/// Solutions of consistent equations A X = B, where A may be singular up to rounding: by SmallLu, and where a pivot of
/// that is as good as zero, by CompletePivotingLu of A with rows of one size. No allocation when the size stays the same.
class ConsistentLu {
 public:
  void factorize(const Matrix& A);
  /// Replaces B by a solution X of A X = B.
  void solve_in_place(Eigen::Map<Matrix> B);

 private:
  SmallLu lu_;
  bool is_singular_ = false;
  Vector scale_;  // of the rows of a singular A
  Matrix scaled_;
  CompletePivotingLu complete_;
};

/// Pseudo-inverse of a small symmetric positive semidefinite matrix, such as a Delassus matrix of redundant contacts, by
/// a Cholesky decomposition with pivoting that ends at the rank r,
///
///   A = L L',   L n x r,   A^+ = K' K,   K = (L' L)^-1 L'.                                                  (2)
///
/// The pivot is the diagonal entry of which elimination has left the largest part, so that units do not matter. No
/// allocation up to the largest size so far.
class SemidefiniteInverse {
 public:
  void factorize(const Eigen::Ref<const Matrix>& A);
  Eigen::Index rank() const { return rank_; }
  /// Replaces B by A^+ B.
  void apply_in_place(Eigen::Ref<Matrix> B);

 private:
  Eigen::Index n_ = 0, rank_ = 0;
  bool is_finite_ = true;
  std::vector<double> L_, gram_, rest_, y_, K_;
};

}  // namespace ricochet
