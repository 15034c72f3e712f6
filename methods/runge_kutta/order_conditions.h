#pragma once

#include <limits>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// The order conditions of all rooted trees with the same number of nodes.
struct OrderConditions {
  int count = 0;        ///< 1, 1, 2, 4, 9, 20, 48, 115, 286, 719 for 1 .. 10 nodes
  double residual = 0;  ///< the largest difference of the two sides of (4)
};

/// The order conditions of a Runge-Kutta method. A rooted tree t whose root carries the subtrees
/// t_1 .. t_m has
///   |t| = 1 + sum_k |t_k|                              nodes                      (1)
///   gamma(t) = |t| prod_k gamma(t_k)                   density                    (2)
///   Phi_i(t) = prod_k sum_j a_ij Phi_j(t_k)            stage weights              (3)
/// and the method is of order p when every tree with at most p nodes fulfils
///   sum_i b_i Phi_i(t) = 1 / gamma(t).                                            (4)
/// @param A, b         n_s x n_s and n_s
/// @param max_nodes    at least 1
/// @param stop_beyond  no trees are grown beyond a number of nodes with a residual above this
/// @return entry p - 1: of the trees with p nodes
/// Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, theorem II.2.13.
std::vector<OrderConditions> order_conditions(const Matrix& A, const Vector& b, int max_nodes,
                                              double stop_beyond = std::numeric_limits<double>::infinity());

/// Largest p <= limit for which the conditions of all trees with at most p nodes hold within the tolerance.
int order_from_trees(const Matrix& A, const Vector& b, int limit, double tolerance);

}  // namespace ricochet
