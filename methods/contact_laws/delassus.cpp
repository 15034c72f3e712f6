#include "methods/contact_laws/delassus.h"

#include <algorithm>
#include <cmath>

namespace ricochet {

void Delassus::reserve(int contacts, int rows) {
  const auto n = static_cast<std::size_t>(contacts);
  for (auto* list : {&sizes_, &row_, &first_, &diagonal_, &next_}) list->reserve(n + 1);
  contact_.reserve(n * n);
  offset_.reserve(n * n);
  values_.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(rows));
}

void Delassus::set_sizes(std::span<const int> sizes) {
  sizes_.assign(sizes.begin(), sizes.end());
  row_.assign(1, 0);
  for (const int size : sizes) row_.push_back(row_.back() + size);
  first_.assign(1, 0);
  diagonal_.clear();
  contact_.clear();
  offset_.clear();
  values_.clear();
}

void Delassus::add_row(std::span<const int> neighbours) {
  const auto i = first_.size() - 1;
  std::size_t end = values_.size();
  for (const int j : neighbours) {
    if (j == static_cast<int>(i)) diagonal_.push_back(n_blocks());
    contact_.push_back(j);
    offset_.push_back(end);
    end += static_cast<std::size_t>(sizes_[i] * sizes_[j]);
  }
  values_.resize(end);
  first_.push_back(n_blocks());
}

void Delassus::row_times(int i, const double* r, const double* b, double* w) const {
  const int n = sizes_[i];
  for (int d = 0; d < n; ++d) w[d] = b[row_[i] + d];
  for (int k = 0; k < n_neighbours(i); ++k) {
    const Block G_ij = block(i, k);
    const double* entry = G_ij.values;
    for (int c = 0; c < G_ij.size; ++c) {
      const double impulse = r[G_ij.row + c];
      for (int d = 0; d < n; ++d) w[d] += *entry++ * impulse;
    }
  }
}

double Delassus::row_terms(int i, const double* r, const double* b) const {
  const int n = sizes_[i];
  double terms[3];
  for (int d = 0; d < n; ++d) terms[d] = std::abs(b[row_[i] + d]);
  for (int k = 0; k < n_neighbours(i); ++k) {
    const Block G_ij = block(i, k);
    const double* entry = G_ij.values;
    for (int c = 0; c < G_ij.size; ++c) {
      const double impulse = std::abs(r[G_ij.row + c]);
      for (int d = 0; d < n; ++d) terms[d] += std::abs(*entry++) * impulse;
    }
  }
  return *std::max_element(terms, terms + n);
}

void Delassus::times(const Vector& r, const Vector& b, Vector& w) const {
  for (int i = 0; i < n_contacts(); ++i) row_times(i, r.data(), b.data(), w.data() + row_[i]);
}

void Delassus::to_dense(Matrix& G) const {
  G.topLeftCorner(n_rows(), n_rows()).setZero();
  for (int i = 0; i < n_contacts(); ++i) {
    for (int k = 0; k < n_neighbours(i); ++k) {
      const Block G_ij = block(i, k);
      G.block(row_[i], G_ij.row, sizes_[i], G_ij.size) = Eigen::Map<const Matrix>(G_ij.values, sizes_[i], G_ij.size);
    }
  }
}

}  // namespace ricochet
