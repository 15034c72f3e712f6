#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// Factorisation without a search for pivots, and solves, of the symmetric indefinite systems
///
///   K x = b,   K = ( W   J' )                                                                                (1)
///                  ( J  -C  )
///
/// of an interior-point method, with the unknowns of the rows last. The first matrix, scaled to largest entries near one
/// in every row, decides on pairs of a row and one of its unknowns, by a matching with large entries of J. A pair is one
/// pivot of two columns, since the diagonal of a row is zero or small. The graph of pairs and single unknowns is ordered
/// once (AMD), single unknowns with a diagonal of zero after their neighbours, and each matrix is then factorised so,
///
///   P K P' = L D L',                                                                                         (2)
///
/// with blocks of one or two columns in D, which has the signs of the eigenvalues of K. Where a pivot is only rounding, new
/// pairs are chosen for that matrix; if this does not help, K is singular as far as this method can tell. Solves are
/// refined with K as it was given, and state their residual. Source of the pairs: Duff, Pralet, Strategies for scaling
/// and pivoting for sparse symmetric indefinite problems, SIAM J. Matrix Anal. Appl. 27 (2005), section 5.
class StaticLdl {
 public:
  /// @param n        unknowns
  /// @param n_rows   unknowns of the rows, the last ones
  /// @param rows, columns  positions of n_entries, from 1, in either triangle; entries at one position are summed
  StaticLdl(int n, int n_rows, int n_entries, const int* rows, const int* columns);

  /// @param values          n_entries, as given
  /// @param with_new_pairs  the pairs are chosen again for this matrix; they are, too, at most failures of (2)
  /// @return false if the matrix is singular or not finite
  bool factorise(const double* values, bool with_new_pairs = false);

  int size() const { return n_; }
  /// Eigenvalues < 0 of the last matrix that was factorised.
  int n_negative() const { return n_negative_; }
  /// Entries of L below its blocks.
  int n_factor_entries() const { return static_cast<int>(L_.size()); }

  /// Replaces b by K^-1 b. @return largest component of the residual, relative to max |b| + min(max |x|, 1e6 max |b|)
  double solve(double* b);

 private:
  /// A pivot: one unknown, or two neighbours in the order.
  struct Node {
    int first = 0, size = 1;
    int rows = 0, values = 0;          // first entries of its column in L_row_ and L_
    int filled = 0;                    // rows so far
    double d = 0, e = 0, f = 0;        // block of D: d, or (d e; e f)
    double i_d = 0, i_e = 0, i_f = 0;  // its inverse
  };

  void prepare(const double* values, bool by_size);
  bool factorise_in_order(const double* values);
  double refine();
  std::vector<double> equilibrated(const double* values) const;
  std::vector<int> match(const std::vector<double>& values, bool by_size) const;
  void order(const std::vector<int>& partner);
  template <int columns, int rows>
  void eliminate(Node& column, Node& row);
  bool invert(Node& node, double magnitude);
  void substitute(Vector& x) const;
  void multiply(const Vector& x, Vector& y) const;

  int n_ = 0, n_rows_ = 0, n_negative_ = 0;
  std::vector<int> given_rows_, given_columns_;  // from 0
  bool is_prepared_ = false;
  int n_singular_ = 0;                  // failures since new pairs helped
  std::vector<double> least_diagonal_;  // in all matrices that pairs were chosen for: Ipopt may add a multiple of 1
  std::vector<int> position_;           // of each unknown in the order of P
  std::vector<Node> nodes_;
  std::vector<int> upper_start_, upper_row_;  // P K P' by columns, upper triangle, the diagonal last
  std::vector<double> upper_;
  std::vector<int> entry_;                    // of each given value: its place in upper_
  std::vector<int> pattern_start_, pattern_;  // per node: nodes of its row of L, in an order of elimination
  std::vector<int> L_row_;                    // per column of L: rows
  std::vector<double> L_;                     // and their one or two values each
  std::vector<double> row_;                   // two accumulators per unknown
  Vector b_, x_, best_, residual_;
};

}  // namespace ricochet
