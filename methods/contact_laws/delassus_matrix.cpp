#include "methods/contact_laws/delassus_matrix.h"

#include <algorithm>
#include <set>

namespace ricochet {

SparseMatrix sparse_matrix(const Delassus& G) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < G.n_contacts(); ++i) {
    for (int k = 0; k < G.n_neighbours(i); ++k) {
      const auto block = G.block(i, k);
      for (int c = 0; c < block.size; ++c) {
        for (int d = 0; d < G.size(i); ++d) {
          const double value = block.values[c * G.size(i) + d];
          if (value != 0) entries.emplace_back(G.row(i) + d, block.row + c, value);
        }
      }
    }
  }
  SparseMatrix matrix(G.n_rows(), G.n_rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

void set_operator(Delassus& op, const std::vector<int>& sizes, const SparseMatrix& G) {
  std::vector<int> contact;  // of each row
  for (std::size_t i = 0; i < sizes.size(); ++i) contact.insert(contact.end(), sizes[i], static_cast<int>(i));
  std::vector<std::set<int>> neighbours(sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) neighbours[i].insert(static_cast<int>(i));
  for (int column = 0; column < G.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator entry(G, column); entry; ++entry) {
      neighbours[contact[entry.row()]].insert(contact[column]);
      neighbours[contact[column]].insert(contact[entry.row()]);
    }
  }
  op.set_sizes(sizes);
  for (const auto& list : neighbours) op.add_row(std::vector<int>(list.begin(), list.end()));
  for (int i = 0; i < op.n_contacts(); ++i) {
    for (int k = 0; k < op.n_neighbours(i); ++k) std::fill_n(op.values(i, k), op.size(i) * op.block(i, k).size, 0.0);
  }
  for (int column = 0; column < G.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator entry(G, column); entry; ++entry) {
      const int row = static_cast<int>(entry.row()), i = contact[row];
      const auto& list = neighbours[i];
      const int k = static_cast<int>(std::distance(list.begin(), list.find(contact[column])));
      op.values(i, k)[(column - op.row(contact[column])) * op.size(i) + row - op.row(i)] += entry.value();
    }
  }
}

}  // namespace ricochet
