#include "methods/linear_algebra/small_lu.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr int kAtOnce = 4;  // columns

/// y -= A x for kAtOnce columns of A, rows from `from` on.
void take_columns(double* __restrict y, const double* __restrict A, int n, const double* x, int from) {
  const double x0 = x[0], x1 = x[1], x2 = x[2], x3 = x[3];
  const double *a0 = A, *a1 = A + n, *a2 = A + 2 * n, *a3 = A + 3 * n;
  for (int i = from; i < n; ++i) y[i] -= a0[i] * x0 + a1[i] * x1 + a2[i] * x2 + a3[i] * x3;
}

/// y -= a x, rows from `from` to `to`.
void take_column(double* __restrict y, const double* __restrict a, double x, int from, int to) {
  for (int i = from; i < to; ++i) y[i] -= a[i] * x;
}

bool is_zero(const double* x) {
  return x[0] == 0 && x[1] == 0 && x[2] == 0 && x[3] == 0;
}

}  // namespace

/// The exchanges of rows that the first `last` columns asked for.
void SmallLu::permute(double* column, int last) const {
  for (int k = 0; k < last; ++k) std::swap(column[k], column[pivots_[k]]);
}

/// Forward substitution with the first `last` columns of L. Subtracts these columns times the solution from the entries
/// below.
void SmallLu::take_lower(double* column, int last) const {
  const double* L = lu_.data();
  int k = 0;
  for (; k + kAtOnce <= last; k += kAtOnce) {
    const double* block = L + static_cast<Eigen::Index>(k) * n_;
    double* x = column + k;
    for (int m = 0; m + 1 < kAtOnce; ++m) take_column(column, block + m * n_, x[m], k + m + 1, k + kAtOnce);
    if (!is_zero(x)) take_columns(column, block, n_, x, k + kAtOnce);
  }
  for (; k < last; ++k) take_column(column, L + static_cast<Eigen::Index>(k) * n_, column[k], k + 1, n_);
}

/// Backward substitution by U.
void SmallLu::divide_by_upper(double* column) const {
  const double* U = lu_.data();
  for (int k = n_ - 1; k >= 0; --k) {
    const double* u = U + static_cast<Eigen::Index>(k) * n_;
    column[k] *= u[k];
    take_column(column, u, column[k], 0, k);
  }
}

void SmallLu::factorize(const Matrix& A) {
  lu_ = A;
  n_ = static_cast<int>(A.rows());
  pivots_.resize(static_cast<std::size_t>(n_));
  smallest_pivot_ = 1;
  double* const all = lu_.data();
  for (int j = 0; j < n_; ++j) {
    double* column = all + static_cast<Eigen::Index>(j) * n_;
    double size = 0;
    for (int i = 0; i < n_; ++i) size = std::max(size, std::abs(column[i]));
    permute(column, j);
    take_lower(column, j);
    int pivot = j;
    for (int i = j + 1; i < n_; ++i) {
      if (std::abs(column[i]) > std::abs(column[pivot])) pivot = i;
    }
    pivots_[j] = pivot;
    const double largest = std::abs(column[pivot]);
    smallest_pivot_ = std::min(size > 0 && largest > 0 ? largest / size : 0.0, smallest_pivot_);
    if (pivot != j) {
      for (int k = 0; k <= j; ++k) std::swap(all[k * n_ + j], all[k * n_ + pivot]);
    }
    const double inverse = 1 / column[j];
    for (int i = j + 1; i < n_; ++i) column[i] *= inverse;
    column[j] = inverse;
  }
}

void SmallLu::solve_in_place(double* b, int columns) const {
  for (int c = 0; c < columns; ++c, b += n_) {
    permute(b, n_);
    take_lower(b, n_);
    divide_by_upper(b);
  }
}

const Matrix& SmallLu::inverse() {
  inverse_.setIdentity(n_, n_);
  solve_in_place(inverse_.data(), n_);
  return inverse_;
}

}  // namespace ricochet
