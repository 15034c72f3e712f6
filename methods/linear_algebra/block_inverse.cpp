#include "methods/linear_algebra/block_inverse.h"

#include <algorithm>

namespace ricochet {

/// Joins what the pattern of A couples. @return whether the islands are others than before
bool BlockInverse::islands_change(const Matrix& A, bool as_one) {
  const int n = static_cast<int>(A.rows());
  sets_.reset(n);
  for (int column = 0; column < n && !as_one; ++column) {
    for (int row = 0; row < n; ++row) {
      if (A(row, column) != 0) sets_.join(row, column);
    }
  }
  if (as_one) sets_.join_all();
  if (islands_.n() != n) return true;
  for (int k = 0; k < n; ++k) {
    if (islands_.members(islands_.of(k)).front() != sets_.of(k)) return true;
  }
  return false;
}

void BlockInverse::compute(const Matrix& A, bool as_one) {
  ++version_;
  if (islands_change(A, as_one)) {
    islands_.assign(sets_);
    blocks_.resize(islands_.count());
    for (int island = 0; island < islands_.count(); ++island) {
      const auto size = static_cast<Eigen::Index>(islands_.members(island).size());
      blocks_[island].resize(size, size);
    }
    inverses_ = blocks_;
    factors_.resize(blocks_.size());
  }
  if (islands_.count() == 1) {
    inverses_[0] = factors_[0].of(A);
    return;
  }
  for (int island = 0; island < islands_.count(); ++island) {
    const auto at = islands_.members(island);
    const int size = static_cast<int>(at.size());
    if (size == 1) {
      inverses_[island](0, 0) = 1 / A(at[0], at[0]);
      continue;
    }
    for (int column = 0; column < size; ++column) {
      for (int row = 0; row < size; ++row) blocks_[island](row, column) = A(at[row], at[column]);
    }
    inverses_[island] = factors_[island].of(blocks_[island]);
  }
}

void BlockInverse::apply(int island, const Vector& x, Vector& y) const {
  const auto at = islands_.members(island);
  const int size = static_cast<int>(at.size());
  const Matrix& W = inverses_[island];
  for (int row = 0; row < size; ++row) {
    double sum = 0;
    for (int column = 0; column < size; ++column) sum += W(row, column) * x[at[column]];
    y[at[row]] = sum;
  }
}

void BlockInverse::apply(std::span<const int> islands, const Vector& x, Vector& y) const {
  for (const int island : islands) apply(island, x, y);
}

void BlockInverse::apply(const Vector& x, Vector& y) const {
  if (islands_.count() == 1) {
    y.noalias() = inverses_[0].lazyProduct(x);
    return;
  }
  for (int island = 0; island < islands_.count(); ++island) apply(island, x, y);
}

}  // namespace ricochet
