#include "problems/dense_solve.h"

#include <gtest/gtest.h>

namespace ricochet {
namespace {

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
