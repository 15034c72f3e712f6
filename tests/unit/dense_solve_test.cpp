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

// Two equal rows leave a pivot of exactly zero, and 0 / 0 in the estimate of the condition.
TEST(DenseSolve, FindsSomeSolutionWhereAPivotVanishes) {
  const Matrix A{{1, 0, 0, 1, 0}, {0, 1, 0, -1, 0}, {0, 0, 1, 0, 1}, {1, 1, 0, 0, 0}, {1, 1, 0, 0, 0}},
      X{{1, 0}, {2, 0}, {3, 1}, {4, 0}, {5, 0}}, B = A * X;
  const Matrix found = solve_consistent(A, B);
  EXPECT_LE((A * found - B).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(DenseSolve, TakesPartialPivotingWhereThatIsEnough) {
  const Matrix A{{2, 1}, {1, 3}}, B{{1}, {2}};
  EXPECT_EQ(solve_consistent(A, B), solve_partial_pivoting(A, B));
}

// Rows 3 = 1 + 2, so the rank is 2: what each decomposition states of A holds to rounding of entries below 10.
TEST(DenseSolve, DecompositionsOfASingularMatrix) {
  const Matrix A{{1, 2, 0, 4}, {0, 1, 3, 1}, {1, 3, 3, 5}};
  EXPECT_EQ(FullPivotingFactors(A).rank(), 2);
  EXPECT_FALSE(is_invertible(A.leftCols(3)));

  const RankDecomposition rank(A, 1e-12);
  EXPECT_EQ(rank.null_space.cols(), 2);
  EXPECT_LE((A * rank.null_space).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LE((A * rank.pseudo_inverse * A - A).cwiseAbs().maxCoeff(), 1e-13);

  const SingularValues svd(A);
  EXPECT_LE(svd.values[2], 1e-14);
  EXPECT_LE((A * svd.V.rightCols(2)).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LE((svd.U.leftCols(3) * svd.values.asDiagonal() * svd.V.leftCols(3).transpose() - A).cwiseAbs().maxCoeff(),
            1e-13);

  const SymmetricEigen eigen(A * A.transpose());
  EXPECT_LE(std::abs(eigen.values[0]), 1e-13);
  EXPECT_NEAR(eigen.values[2], svd.values[0] * svd.values[0], 1e-12);
  EXPECT_LE((A.transpose() * eigen.vectors.col(0)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(DenseSolve, FactorsOfARegularMatrix) {
  const Matrix A{{4, 1, 0}, {1, 3, 1}, {0, 1, 2}};
  const Vector x{{1, -2, 3}};
  EXPECT_TRUE(is_invertible(A));
  EXPECT_LE((PartialPivotingFactors(A).solve(A * x) - x).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LE((PartialPivotingFactors(A).solve_columns(A) - Matrix::Identity(3, 3)).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LE((FullPivotingFactors(A).solve(A * x) - x).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_FALSE(FullPivotingFactors(A, 0.9).is_invertible()) << "a threshold above the last pivot";
  EXPECT_LE((inverse_of(A) * A - Matrix::Identity(3, 3)).cwiseAbs().maxCoeff(), 1e-14);
  const Matrix lower = CholeskyFactors(A).solve_lower(A);  // L^-1 L L' = L'
  EXPECT_LE((lower.transpose() * lower - A).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace ricochet
