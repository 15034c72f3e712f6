#pragma once

#include <Eigen/SparseCore>

#include "methods/contact_laws/delassus.h"

namespace ricochet {

// Conversions between the Delassus operator and a sparse matrix, for other programs. They allocate: not for the time
// step.

using SparseMatrix = Eigen::SparseMatrix<double>;

/// G as a sparse matrix of its nonzero entries.
SparseMatrix sparse_matrix(const Delassus& G);

/// Blocks where the matrix has entries, or its transpose has, and on the diagonal.
/// @param sizes  1 + n_t of every contact; @param G  as many rows and columns as these have together
void set_operator(Delassus& op, const std::vector<int>& sizes, const SparseMatrix& G);

}  // namespace ricochet
