#pragma once

#include <vector>

namespace ricochet {

/// LU factorisation with partial pivoting of a band matrix, LAPACK's dgbtrf: of n unknowns in time n lower (lower +
/// upper), where entries (i, j) with j - upper <= i <= j + lower may differ from zero.
class BandLu {
 public:
  /// Zero, to be filled. Allocates only for more entries than ever before.
  void set_zero(int n, int lower, int upper);
  double& entry(int i, int j) {
    return entries_[static_cast<std::size_t>(j) * stride() + static_cast<std::size_t>(upper_ + i - j)];
  }

  /// Replaces the matrix by its factors.
  void factorize();

  /// Smallest pivot, each relative to the largest entry of its column of U: 0 for a singular matrix, and of the size of
  /// rounding for one that is singular but for rounding.
  double smallest_pivot() const { return smallest_; }

  /// x = A^-1 x, in place.
  void solve(double* x) const;

 private:
  int stride() const { return lower_ + upper_ + 1; }

  int n_ = 0, lower_ = 0, upper_ = 0;  // upper_: of U, with the diagonals that pivoting fills
  std::vector<double> entries_;        // column by column, of L below the diagonal and of U from it on
  std::vector<int> pivots_;
  double smallest_ = 1;
};

}  // namespace ricochet
