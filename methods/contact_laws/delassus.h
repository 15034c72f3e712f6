#pragma once

#include <span>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// Delassus operator G = J' W J of the active contacts, W the inverse of a mass matrix or of an iteration matrix, in
/// rows of blocks:
///
///   (G r)_i = sum_j G_ij r_j,   G_ij: (1 + n_t^i) x (1 + n_t^j), normal first, then tangents
///
/// G_ij is stored when an impulse of contact j can move contact i. A row of n beads has 3 n - 2 blocks, not n^2.
/// Storage is kept between steps and grows only for more blocks than ever before.
class Delassus {
 public:
  struct Block {
    int contact = 0;
    int row = 0;                     ///< first row of `contact`
    int size = 0;                    ///< rows of `contact`
    const double* values = nullptr;  ///< column-major
  };

  /// Reserves storage for full blocks. @param rows  of all contacts together
  void reserve(int contacts, int rows);

  /// Begins a new operator. @param sizes  1 + n_t of every contact
  void set_sizes(std::span<const int> sizes);
  /// Pattern, contact after contact. @param neighbours  contacts that move this one, ascending, itself among them
  void add_row(std::span<const int> neighbours);
  /// Values of the k-th block of contact i, to be filled,
  double* values(int i, int k) { return values_.data() + offset_[first_[i] + k]; }
  /// or all of them, column after column: those of column d of contact j are J_i,e' (W J_j,d).
  /// @param begin(j, d)  computes W J_j,d; @param entry(i, e)  J_i,e' times it; @param end(j)  forgets it
  void fill(auto&& begin, auto&& entry, auto&& end);

  int n_contacts() const { return static_cast<int>(sizes_.size()); }
  int n_rows() const { return row_.back(); }
  int n_blocks() const { return static_cast<int>(contact_.size()); }
  int size(int i) const { return sizes_[i]; }
  int row(int i) const { return row_[i]; }
  int n_neighbours(int i) const { return first_[i + 1] - first_[i]; }
  Block block(int i, int k) const {
    const int b = first_[i] + k, j = contact_[b];
    return {j, row_[j], sizes_[j], values_.data() + offset_[b]};
  }
  /// G_ii
  const double* diagonal(int i) const { return values_.data() + offset_[diagonal_[i]]; }
  double diagonal(int i, int d) const { return diagonal(i)[d * (sizes_[i] + 1)]; }

  /// w_i = (G r)_i + b_i. @param w  size(i)
  void row_times(int i, const double* r, const double* b, double* w) const;
  /// w = G r + b
  void times(const Vector& r, const Vector& b, Vector& w) const;
  /// |b_i| + sum_j |G_ij| |r_j|, the largest of its rows: the terms that cancel in w_i.
  double row_terms(int i, const double* r, const double* b) const;
  /// @param G  at least n_rows x n_rows
  void to_dense(Matrix& G) const;

 private:
  std::vector<int> sizes_, row_{0};
  std::vector<int> first_{0};  // blocks of each contact
  std::vector<int> diagonal_;  // its block G_ii
  std::vector<int> contact_;   // per block: j
  std::vector<std::size_t> offset_;
  std::vector<double> values_;
  std::vector<int> next_;  // of fill(), per contact: the block of its row that the column has reached
};

void Delassus::fill(auto&& begin, auto&& entry, auto&& end) {
  next_.assign(sizes_.size(), 0);
  for (int j = 0; j < n_contacts(); ++j) {
    for (int d = 0; d < sizes_[j]; ++d) {
      begin(j, d);
      for (int k = 0; k < n_neighbours(j); ++k) {  // the pattern is symmetric, and columns ascend
        const int i = contact_[first_[j] + k];
        double* column = values_.data() + offset_[first_[i] + next_[i]] + d * sizes_[i];
        for (int e = 0; e < sizes_[i]; ++e) column[e] = entry(i, e);
      }
      end(j);
    }
    for (int k = 0; k < n_neighbours(j); ++k) ++next_[contact_[first_[j] + k]];
  }
}

}  // namespace ricochet
