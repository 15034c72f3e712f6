#pragma once

#include <optional>
#include <vector>

#include "reference/certified/ball.h"

/// @file
/// Linear systems of balls.

namespace ricochet::reference::certified {

/// Rows of balls.
using BallMatrix = std::vector<std::vector<Ball>>;

/// Solves A X = B for all members of A and B. @returns nothing if A may be singular
std::optional<BallMatrix> solve(const BallMatrix& A, const BallMatrix& B, slong bits);

}  // namespace ricochet::reference::certified
