#include "problems/dense_solve.h"

#include <gtest/gtest.h>

namespace ricochet {
namespace {

// x_1 + x_2 is determined, x_1 and x_2 are not; the third row has the size of a step of 1e-9 s, and its own unknown.
TEST(DenseSolve, FindsSomeSolutionOfASingularSystem) {
  const Matrix A{{1, 1, 0, 2}, {3, 3, 0, 1}, {0, 0, 1e-18, 0}, {2, 2, 0, 3}}, X{{1}, {2}, {3}, {4}}, B = A * X;
  const Matrix found = solve_consistent(A, B);
  EXPECT_NEAR(found(0, 0) + found(1, 0), 3, 1e-14);
  EXPECT_NEAR(found(2, 0), 3, 1e-14);
  EXPECT_NEAR(found(3, 0), 4, 1e-14);
  EXPECT_LE(found.cwiseAbs().maxCoeff(), 100) << "nothing of what is free is amplified";
}

TEST(DenseSolve, TakesPartialPivotingWhereThatIsEnough) {
  const Matrix A{{2, 1}, {1, 3}}, B{{1}, {2}};
  EXPECT_EQ(solve_consistent(A, B), solve_partial_pivoting(A, B));
}

}  // namespace
}  // namespace ricochet
