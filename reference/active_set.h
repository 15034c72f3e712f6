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

}  // namespace ricochet::reference
