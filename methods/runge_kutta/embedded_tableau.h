#pragma once

#include <string>
#include <vector>

#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/problem.h"

namespace ricochet {

/// Tableau of an explicit Runge-Kutta pair with an error estimate,
///
///   k_i = f(t_0 + c_i h, y_0 + h sum_{j<i} a_ij k_j)
///   y_1 = y_0 + h sum_i b_i k_i                          order `order`, propagated        (1)
///   err = h sum_i e_i k_i,  e = b - b_hat                                                 (2)
///
/// where b_hat are the weights of the embedded solution. The coefficients as constant expressions are in
/// explicit_coefficients.h.
struct EmbeddedTableau {
  std::string id;      ///< for example "dopri5"; the path of a tableau from a file
  std::string name;    ///< for example "Dormand-Prince 5(4)"
  std::string source;  ///< of the coefficients

  int order = 0;  ///< of y_1: its error in one step is O(h^{order + 1})

  /// The estimate by which the step is controlled is O(h^{error_order + 1}): error_order is the order of b_hat, or that
  /// of b where this is lower; 4 for Dormand-Prince 5(4). With two estimates it belongs to their combination (3).
  int error_order = 0;

  int n_s = 0;                         ///< stages
  bool is_first_same_as_last = false;  ///< the last stage is f(t_0 + h, y_1), the first one of the next step

  Matrix A;  ///< n_s x n_s, zero on the diagonal and above
  Vector b;  ///< n_s
  Vector c;  ///< n_s, the row sums of A
  Vector e;  ///< n_s, of order error_order; of DOP853 of order 5

  /// n_s, the second estimate of DOP853, of order 3; empty otherwise. The step is controlled by the combination
  ///   |err|^2 / sqrt(|err|^2 + 0.01 |err_2|^2) = O(h^{2 * 6 - 4}),  error_order = 7.                      (3)
  Vector e_2;
};

/// The square of the combination (3). @param first, second  |err|^2, |err_2|^2
inline double combined_squares(double first, double second) {
  return first > 0 ? first * first / (first + 0.01 * second) : 0;
}

/// The tableau of (1) alone.
ButcherTableau butcher_tableau(const EmbeddedTableau& pair);

/// Pairs whose coefficients are here: "bogacki-shampine-3-2", "bogacki-shampine-5-4", "dop853", "dopri5",
/// "prince-dormand-8-7", "tsitouras-5-4", "verner-7-6", "verner-9-8".
std::vector<std::string> embedded_tableau_names();

/// @throws InputError for an unknown name, with the known ones
EmbeddedTableau embedded_tableau(const std::string& name);

/// Reads {"A": [[0, 0], [1, 0]], "b": ["1/2", "1/2"], "b_hat": [1, 0], "order": 2, "error_order": 1, "name": "..."}
/// with "e" in the place of "b_hat" where the source gives the difference. "name", "source", "c" and the orders may be
/// missing: orders are then those that the order conditions confirm, at most 14.
/// @throws InputError when the file is unreadable, a field is unknown or missing, sizes differ, A is not zero on the
/// diagonal and above, c is not the row sum of A, a stated order is higher than the one that the order conditions
/// confirm, or b and b_hat are the same
EmbeddedTableau read_embedded_tableau(const std::string& path);

}  // namespace ricochet
