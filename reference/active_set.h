#pragma once

#include <optional>

#include "problems/problem.h"

namespace ricochet::reference {

/// Solves the linear complementarity problem w = M z + q, 0 <= w _|_ z >= 0 by trying every active set. This is slow
/// and simple, and shares no idea with the solvers for which it is the reference. Of several solutions it returns the
/// one with fewest active pairs.
/// @param M  n x n, n <= kMaxPairs; @param q  n
/// @return nothing if no active set fits. Violations below 1e-12 of the size of the terms count as rounding.
constexpr int kMaxPairs = 16;
std::optional<Vector> solve_lcp_by_enumeration(const Matrix& M, const Vector& q);

/// Solves the same problem for a symmetric, positive semidefinite M of any size by the dual active-set method of Goldfarb
/// and Idnani (Math. Program. 27, 1983). With M = N' N the pairs are the constraints N' x >= -q of the shortest x = N z.
/// The most violated constraint p enters the active set A. With the step
///
///   d_A = -M_AA^-1 M_Ap,   d_p = 1                                                       (1)
///
/// z moves along d until w_p = 0, or until some z_j = 0 and j leaves A. Columns of N in A are independent. If p depends
/// on them, w_p does not change along d, and one of A leaves first.
/// @return nothing if N' x >= -q has no solution
std::optional<Vector> solve_lcp_by_dual_steps(const Matrix& M, const Vector& q);

}  // namespace ricochet::reference
