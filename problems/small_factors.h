#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

// Decompositions of the small matrices of right-hand sides, by plain loops over columns: Eigen's take ten times as long
// for these sizes, and allocate.

/// M = L D L', symmetric and positive definite, L with ones on its diagonal.
class SymmetricFactors {
 public:
  /// @param is_diagonal  whether no M has other entries
  SymmetricFactors(Eigen::Index n, bool is_diagonal) : is_diagonal_(is_diagonal), inverse_d_(n) {
    if (!is_diagonal_) L_.resize(n, n);
  }

  /// False when M is not positive definite.
  bool compute(const Matrix& M) {
    const Eigen::Index n = inverse_d_.size();
    if (is_diagonal_) {
      inverse_d_ = M.diagonal().cwiseInverse();
      return (M.diagonal().array() > 0).all();
    }
    L_ = M;
    for (Eigen::Index j = 0; j < n; ++j) {
      double* below = column(j);
      if (!(below[j] > 0)) return false;
      inverse_d_[j] = 1 / below[j];
      for (Eigen::Index k = j + 1; k < n; ++k) {
        double* right = column(k);
        right[j] = below[k] * inverse_d_[j];
        for (Eigen::Index i = k; i < n; ++i) right[i] -= right[j] * below[i];
      }
      for (Eigen::Index k = j + 1; k < n; ++k) below[k] = column(k)[j];
    }
    return true;
  }

  /// x <- M^-1 x. @param x  n
  void solve(double* x) const {
    const Eigen::Index n = inverse_d_.size();
    for (Eigen::Index j = 0; j < n && !is_diagonal_; ++j) {
      const double* below = column(j);
      for (Eigen::Index i = j + 1; i < n; ++i) x[i] -= below[i] * x[j];
    }
    for (Eigen::Index j = 0; j < n; ++j) x[j] *= inverse_d_[j];
    for (Eigen::Index j = n - 1; j > 0 && !is_diagonal_; --j) {
      const double* above = column(j);
      for (Eigen::Index i = 0; i < j; ++i) x[i] -= above[i] * x[j];
    }
  }

 private:
  double* column(Eigen::Index j) { return L_.data() + j * L_.rows(); }
  const double* column(Eigen::Index j) const { return L_.data() + j * L_.rows(); }

  const bool is_diagonal_;
  Matrix L_;  // below the diagonal, and L' above
  Vector inverse_d_;
};

/// A = L U after exchanges of rows and columns. The pivot of each step is the largest remaining entry.
class PivotedFactors {
 public:
  /// False if a pivot is not larger than this fraction of the largest one.
  bool compute(const Matrix& A, double threshold) {
    const Eigen::Index n = A.rows();
    LU_ = A;
    rows_.resize(static_cast<std::size_t>(n));
    columns_.resize(static_cast<std::size_t>(n));
    double largest = 0, smallest = INFINITY;
    for (Eigen::Index j = 0; j < n; ++j) {
      const double pivot = exchange(j);
      largest = std::max(largest, pivot);
      smallest = std::min(smallest, pivot);
      if (!(smallest > threshold * largest)) return false;
      double* below = column(j);
      for (Eigen::Index i = j + 1; i < n; ++i) below[i] /= below[j];
      for (Eigen::Index k = j + 1; k < n; ++k) {
        double* right = column(k);
        for (Eigen::Index i = j + 1; i < n; ++i) right[i] -= right[j] * below[i];
      }
    }
    return true;
  }

  /// x <- A^-1 x. @param x  n
  void solve(double* x) const {
    const Eigen::Index n = LU_.rows();
    for (Eigen::Index j = 0; j < n; ++j) std::swap(x[j], x[rows_[j]]);
    for (Eigen::Index j = 0; j < n; ++j) {
      const double* below = column(j);
      for (Eigen::Index i = j + 1; i < n; ++i) x[i] -= below[i] * x[j];
    }
    for (Eigen::Index j = n - 1; j >= 0; --j) {
      const double* above = column(j);
      x[j] /= above[j];
      for (Eigen::Index i = 0; i < j; ++i) x[i] -= above[i] * x[j];
    }
    for (Eigen::Index j = n - 1; j >= 0; --j) std::swap(x[j], x[columns_[j]]);
  }

 private:
  /// Moves the largest remaining entry to (j, j). @return its absolute value
  double exchange(Eigen::Index j) {
    const Eigen::Index n = LU_.rows();
    Eigen::Index row = j, pivot_column = j;
    double pivot = -1;
    for (Eigen::Index k = j; k < n; ++k) {
      for (Eigen::Index i = j; i < n; ++i) {
        if (!(std::abs(column(k)[i]) > pivot)) continue;
        pivot = std::abs(column(k)[i]);
        row = i;
        pivot_column = k;
      }
    }
    rows_[j] = row;
    columns_[j] = pivot_column;
    for (Eigen::Index k = 0; k < n && row != j; ++k) std::swap(column(k)[j], column(k)[row]);
    for (Eigen::Index i = 0; i < n && pivot_column != j; ++i) std::swap(column(j)[i], column(pivot_column)[i]);
    return pivot;
  }

  double* column(Eigen::Index j) { return LU_.data() + j * LU_.rows(); }
  const double* column(Eigen::Index j) const { return LU_.data() + j * LU_.rows(); }

  Matrix LU_;
  std::vector<Eigen::Index> rows_, columns_;  // exchanged with j in step j
};

}  // namespace ricochet
