#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// LU factorisation with partial pivoting of a band matrix: of n unknowns in time n lower (lower + upper), where
/// entries (i, j) with j - upper <= i <= j + lower may differ from zero. Source: Golub, Van Loan, Matrix Computations,
/// section 4.3.
class BandLu {
 public:
  /// Zero, to be filled. Allocates only for more entries than ever before.
  void set_zero(int n, int lower, int upper) {
    n_ = n;
    lower_ = lower;
    upper_ = upper + lower;  // pivoting fills as many diagonals again
    entries_.assign(static_cast<std::size_t>(n) * stride(), 0.0);
    pivots_.resize(n);
  }
  double& entry(int i, int j) { return entries_[static_cast<std::size_t>(j) * stride() + upper_ + i - j]; }

  /// Replaces the matrix by its factors.
  void factorize() {
    smallest_ = 1;
    for (int k = 0; k < n_; ++k) {
      const int last_row = std::min(n_ - 1, k + lower_), last_column = std::min(n_ - 1, k + upper_);
      double* column = &entry(k, k);
      const auto is_less = [](double a, double b) { return std::abs(a) < std::abs(b); };
      const int below = static_cast<int>(std::max_element(column, column + last_row - k + 1, is_less) - column);
      pivots_[k] = k + below;
      double largest = std::abs(column[below]);  // of its column, the part that is in U already with it
      for (int i = std::max(0, k - upper_); i < k; ++i) largest = std::max(largest, std::abs(entry(i, k)));
      smallest_ = largest > 0 ? std::min(smallest_, std::abs(column[below]) / largest) : 0;
      if (!(std::abs(column[below]) > 0)) continue;
      if (below > 0) {
        for (int j = k; j <= last_column; ++j) std::swap(entry(k, j), entry(k + below, j));
      }
      for (int i = 1; i <= last_row - k; ++i) column[i] /= column[0];
      for (int j = k + 1; j <= last_column; ++j) {
        double* other = &entry(k, j);
        const double factor = other[0];
        if (factor == 0) continue;
        for (int i = 1; i <= last_row - k; ++i) other[i] -= column[i] * factor;
      }
    }
  }

  /// Smallest pivot, each relative to the largest entry of its column of U: 0 for a singular matrix, and of the size of
  /// rounding for one that is singular but for rounding.
  double smallest_pivot() const { return smallest_; }

  /// x = A^-1 x, in place.
  void solve(double* x) const {
    for (int k = 0; k < n_; ++k) {
      std::swap(x[k], x[pivots_[k]]);
      const double* column = column_at(k);
      const double x_k = x[k];
      const int last = std::min(n_ - 1 - k, lower_);
      for (int i = 1; i <= last; ++i) x[k + i] -= column[i] * x_k;
    }
    for (int k = n_ - 1; k >= 0; --k) {
      const double* column = column_at(k);
      const double x_k = x[k] /= column[0];
      for (int i = std::max(-k, -upper_); i < 0; ++i) x[k + i] -= column[i] * x_k;
    }
  }

 private:
  int stride() const { return lower_ + upper_ + 1; }
  const double* column_at(int k) const { return entries_.data() + static_cast<std::size_t>(k) * stride() + upper_; }

  int n_ = 0, lower_ = 0, upper_ = 0;  // upper_: of U
  std::vector<double> entries_;        // column by column, of L below the diagonal and of U from it on
  std::vector<int> pivots_;
  double smallest_ = 1;
};

}  // namespace ricochet
