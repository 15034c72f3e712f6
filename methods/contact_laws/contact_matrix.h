#pragma once

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <vector>

#include "methods/contact_laws/delassus.h"

namespace ricochet {

/// A square matrix over the rows of a Delassus operator, factorised by LU with pivoting: dense up to
/// kMaxDenseContacts, sparse above (Eigen's SparseLU, which allocates as a sparse factorisation must). The order of
/// elimination is kept while the pattern stays the same.
class ContactMatrix {
 public:
  /// Begins a matrix of zeros.
  void begin(int n_contacts, int n_rows);
  /// Adds A_r s_i + A_w (G s)_i, in the rows of contact i.
  void add_rows(const Delassus& G, int i, const double A_r[3][3], const double A_w[3][3]);
  /// @return whether it is regular
  bool factorize();
  /// x <- the solution of A x = rhs, their first n_rows entries. @return whether x is finite
  bool solve(const Vector& rhs, Vector& x);

 private:
  void add(int row, int column, double value) {
    if (value == 0) return;
    if (is_dense_)
      dense_(row, column) += value;
    else
      entries_.emplace_back(row, column, value);
  }
  void analyze();

  int n_rows_ = 0;
  bool is_dense_ = true;
  Matrix dense_;
  Eigen::PartialPivLU<Matrix> dense_lu_;
  Vector padded_, solution_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::SparseMatrix<double> sparse_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> sparse_lu_;
  std::vector<int> outer_, inner_;  // pattern that was analysed
};

}  // namespace ricochet
