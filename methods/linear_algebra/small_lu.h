#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// LU factorisation of a small dense matrix with partial pivoting,
///
///   P A = L U,   L with a unit diagonal,                                                                    (1)
///
/// and its solves. Each column subtracts the contributions of the columns before it, four of them at a time, so that
/// the inner loops are long and contiguous, with eight operations per entry. Below about 100 unknowns this is faster
/// than a blocked factorisation, which has to pack its blocks. No allocation when the size stays the same.
class SmallLu {
 public:
  void factorize(const Matrix& A);

  /// Smallest pivot, each relative to the largest entry that its column had in A: 0 for a singular matrix, and of the
  /// size of rounding for one that is singular but for rounding.
  double smallest_pivot() const { return smallest_pivot_; }

  /// Replaces columns b by A^-1 b. @param b  n x `columns`, one column after the other
  void solve_in_place(double* b, int columns = 1) const;
  /// The inverse of the factorised matrix; its entries are not finite when that is singular.
  const Matrix& inverse();
  /// A^-1 by both of these.
  const Matrix& of(const Matrix& A) {
    factorize(A);
    return inverse();
  }

 private:
  void permute(double* column, int last) const;
  void take_lower(double* column, int last) const;
  void divide_by_upper(double* column) const;

  int n_ = 0;
  Matrix lu_;                // n x n: L below the diagonal, U above it, and on it the inverses of the pivots
  std::vector<int> pivots_;  // row k was exchanged with row pivots_[k]
  double smallest_pivot_ = 0;
  Matrix inverse_;
};

}  // namespace ricochet
