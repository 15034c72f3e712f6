#pragma once

#include <optional>

#include "problems/problem.h"

namespace ricochet::reference {

/// z with w = M z + q, 0 <= w _|_ z >= 0 (linear complementarity), found by trying every active set: slow, and so
/// simple that it shares no idea with the solvers it is a reference for. Of several solutions the one with fewest
/// active pairs.
/// @param M  n x n, n <= kMaxPairs; @param q  n
/// @return nothing when no active set fits. Violations below 1e-12 of the size of the terms are rounding.
constexpr int kMaxPairs = 16;
std::optional<Vector> solve_lcp_by_enumeration(const Matrix& M, const Vector& q);

}  // namespace ricochet::reference
