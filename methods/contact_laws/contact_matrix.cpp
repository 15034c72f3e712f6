#include "methods/contact_laws/contact_matrix.h"

#include <algorithm>

#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {

void ContactMatrix::begin(int n_contacts, int n_rows) {
  n_rows_ = n_rows;
  is_dense_ = n_contacts <= kMaxDenseContacts;
  if (!is_dense_) return entries_.clear();
  // A dense matrix keeps its largest size, with an identity after the problem: sizes that change would allocate.
  const int size = std::max(n_rows, static_cast<int>(dense_.rows()));
  if (dense_.rows() != size) {
    dense_.resize(size, size);
    padded_.setZero(size);
    solution_.setZero(size);
  }
  dense_.setZero();
  dense_.diagonal().tail(size - n_rows).setOnes();
}

void ContactMatrix::add_rows(const Delassus& G, int i, const double A_r[3][3], const double A_w[3][3]) {
  const int row = G.row(i), n = G.size(i);
  for (int d = 0; d < n; ++d) {
    for (int e = 0; e < n; ++e) add(row + d, row + e, A_r[d][e]);
    if (A_w[d][0] == 0 && A_w[d][1] == 0 && A_w[d][2] == 0) continue;
    for (int k = 0; k < G.n_neighbours(i); ++k) {
      const auto block = G.block(i, k);
      for (int c = 0; c < block.size; ++c) {
        double value = 0;
        for (int e = 0; e < n; ++e) value += A_w[d][e] * block.values[c * n + e];
        add(row + d, block.row + c, value);
      }
    }
  }
}

/// Computes the order of elimination unless it is known for this pattern.
void ContactMatrix::analyze() {
  const int *outer = sparse_.outerIndexPtr(), *inner = sparse_.innerIndexPtr();
  if (std::equal(outer, outer + n_rows_ + 1, outer_.begin(), outer_.end()) &&
      std::equal(inner, inner + sparse_.nonZeros(), inner_.begin(), inner_.end()))
    return;
  sparse_lu_.analyzePattern(sparse_);
  outer_.assign(outer, outer + n_rows_ + 1);
  inner_.assign(inner, inner + sparse_.nonZeros());
}

bool ContactMatrix::factorize() {
  if (is_dense_) {
    dense_lu_.compute(dense_);
    return true;
  }
  sparse_.resize(n_rows_, n_rows_);
  sparse_.setFromTriplets(entries_.begin(), entries_.end());
  analyze();
  sparse_lu_.factorize(sparse_);
  return sparse_lu_.info() == Eigen::Success;
}

bool ContactMatrix::solve(const Vector& rhs, Vector& x) {
  if (is_dense_) {
    padded_.head(n_rows_) = rhs.head(n_rows_);
    padded_.tail(padded_.size() - n_rows_).setZero();
    solution_ = dense_lu_.permutationP() * padded_;
    dense_lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(solution_);
    dense_lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(solution_);
    x.head(n_rows_) = solution_.head(n_rows_);
  } else {
    x.head(n_rows_) = sparse_lu_.solve(rhs.head(n_rows_));
  }
  return x.head(n_rows_).allFinite();
}

}  // namespace ricochet
