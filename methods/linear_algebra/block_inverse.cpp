#include "methods/linear_algebra/block_inverse.h"

namespace ricochet {

/// Connected components of the pattern of A. @return whether they are others than before
bool BlockInverse::find_blocks(const Matrix& A, bool as_one) {
  const int n = static_cast<int>(A.rows());
  blocks_.reset(n);
  for (int column = 0; column < n && !as_one; ++column) {
    for (int row = 0; row < n; ++row) {
      if (A(row, column) != 0) blocks_.join(row, column);
    }
  }
  if (as_one) blocks_.join_all();
  bool changed = static_cast<int>(block_of_.size()) != n;
  for (int k = 0; k < n; ++k) changed = changed || coordinates_[first_[block_of_[k]]] != blocks_.of(k);
  return changed;
}

void BlockInverse::compute(const Matrix& A, bool as_one) {
  const int n = static_cast<int>(A.rows());
  ++version_;
  if (find_blocks(A, as_one)) {
    block_of_.assign(n, -1);
    first_.assign(1, 0);
    coordinates_.clear();
    parts_.clear();
    for (int k = 0; k < n; ++k) {
      if (blocks_.of(k) != k) continue;
      const int block = static_cast<int>(parts_.size());
      for (int j = k; j < n; ++j) {
        if (blocks_.of(j) != k) continue;
        block_of_[j] = block;
        coordinates_.push_back(j);
      }
      first_.push_back(static_cast<int>(coordinates_.size()));
      parts_.emplace_back(size(block), size(block));
    }
    inverses_ = parts_;
    factors_.resize(parts_.size());
  }
  if (n_blocks() == 1) {
    inverses_[0] = factors_[0].of(A);
    return;
  }
  for (int b = 0; b < n_blocks(); ++b) {
    const int* at = coordinates(b);
    if (size(b) == 1) {
      inverses_[b](0, 0) = 1 / A(at[0], at[0]);
      continue;
    }
    for (int column = 0; column < size(b); ++column) {
      for (int row = 0; row < size(b); ++row) parts_[b](row, column) = A(at[row], at[column]);
    }
    inverses_[b] = factors_[b].of(parts_[b]);
  }
}

void BlockInverse::apply(int block, const Vector& x, Vector& y) const {
  const int* at = coordinates(block);
  const Matrix& W = inverses_[block];
  for (int row = 0; row < size(block); ++row) {
    double sum = 0;
    for (int column = 0; column < size(block); ++column) sum += W(row, column) * x[at[column]];
    y[at[row]] = sum;
  }
}

void BlockInverse::apply(const Vector& x, Vector& y) const {
  if (n_blocks() == 1) {
    y.noalias() = inverses_[0].lazyProduct(x);
    return;
  }
  for (int b = 0; b < n_blocks(); ++b) apply(b, x, y);
}

}  // namespace ricochet
