#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

struct DiagonalTableau;

/// Butcher tableau of a Runge-Kutta method,
///
///   c | A        stage j:  x_j = x_0 + h sum_k a_jk x'_k,  at t_0 + c_j h
///   --+---       output:   x_1 = x_0 + h sum_k b_k x'_k
///     | b'
struct ButcherTableau {
  std::string name;  ///< for example "radau-iia:3"
  int n_s = 0;       ///< stages
  int order = 0;     ///< classical order on smooth problems
  Matrix A;          ///< n_s x n_s
  Vector b, c;       ///< n_s

  /// Weights w with w' (stage values) = value of the stage polynomial at the right end. The last unit vector when the
  /// last stage is the output; empty when two abscissae coincide, so that no polynomial passes through the stages.
  Vector right_end;

  /// A by its eigenvalues (diagonal_tableau.h); null if they were not requested, or if A is not diagonalisable.
  std::shared_ptr<const DiagonalTableau> diagonal;

  /// Stages keep contacts closed by zero accelerations of their gaps (methods/modes), as in an embedded pair; an element
  /// is then known by its two ends. Otherwise the gaps and slip velocities of the stages are zero.
  bool holds_accelerations = false;

  /// The last stage is the output: a_{n_s,k} = b_k. Then c_{n_s} = 1.
  bool is_stiffly_accurate() const;
};

/// Families whose coefficients are computed here: "gauss", "radau-ia", "radau-iia", "lobatto-iiia", "lobatto-iiib",
/// "lobatto-iiic".
std::vector<std::string> tableau_families();

/// Coefficients are correctly rounded: the abscissae come from GSL's polynomial roots, Newton polishes them in 60
/// digits (CLN), everything else is exact integration of Lagrange polynomials in 60 digits, rounded once at the end.
/// @param n_s  1..9, Lobatto 2..9
/// @throws InputError for an unknown family or number of stages
/// Source: Hairer, Wanner, Solving Ordinary Differential Equations II, section IV.5.
ButcherTableau make_tableau(const std::string& family, int n_s);

/// Reads {"name": "...", "A": [["1/4", "1/4-sqrt(3)/6"], ...], "b": [...], "c": [...], "order": 4} with all but "A" and
/// "b" optional. @throws InputError when the file is unreadable, a field is unknown, sizes differ, c is not the row sum
/// of A, or the stated order is higher than the one that the order conditions confirm
ButcherTableau read_tableau_file(const std::string& path);

/// Residuals of Butcher's simplifying assumptions, maximum over the conditions up to the given number:
///   B(p): sum_i b_i c_i^{k-1} = 1/k,  C(q): sum_j a_ij c_j^{k-1} = c_i^k / k,
///   D(r): sum_i b_i c_i^{k-1} a_ij = b_j (1 - c_j^k) / k
double residual_B(const ButcherTableau& tableau, int p);
double residual_C(const ButcherTableau& tableau, int q);
double residual_D(const ButcherTableau& tableau, int r);

/// Order that is certain: from B, C, D (Butcher 1964: B(p), C(q), D(r) with p <= q + r + 1 and p <= 2 q + 2), or from
/// the order conditions of all rooted trees with up to 6 nodes, whichever proves more.
int verified_order(const ButcherTableau& tableau);

}  // namespace ricochet
