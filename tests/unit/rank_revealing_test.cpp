#include "methods/linear_algebra/rank_revealing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

Matrix random_matrix(Eigen::Index rows, Eigen::Index cols, std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Matrix::NullaryExpr(rows, cols, [&] { return normal(random); });
}

TEST(CompletePivotingLu, SolvesRegularSystems) {
  std::mt19937 random(1);
  CompletePivotingLu lu;
  for (const Eigen::Index n : {1, 7, 3, 12}) {
    const Matrix A = random_matrix(n, n, random), X = random_matrix(n, 2, random);
    lu.factorize(A);
    Matrix B = A * X;
    lu.solve_in_place(B);
    EXPECT_EQ(lu.rank(), n);
    EXPECT_LE((B - X).cwiseAbs().maxCoeff(), 1e-11) << "rounding times a condition number of up to 1e4";
  }
}

// Redundant contacts: rows and columns that depend on each other, at several ranks.
TEST(CompletePivotingLu, FindsSomeSolutionOfConsistentEquations) {
  std::mt19937 random(2);
  CompletePivotingLu lu;
  for (const Eigen::Index rank : {0, 1, 4}) {
    const Matrix A = random_matrix(6, rank, random) * random_matrix(rank, 6, random),
                 B = A * random_matrix(6, 3, random);
    lu.factorize(A);
    EXPECT_EQ(lu.rank(), rank);
    Matrix X = B;
    lu.solve_in_place(X);
    EXPECT_LE((A * X - B).cwiseAbs().maxCoeff(), 1e-11);
  }
}

// x_1 + x_2 is determined, x_1 and x_2 are not.
TEST(CompletePivotingLu, AmplifiesNothingThatIsFree) {
  const Matrix A{{1, 1, 2}, {3, 3, 1}, {2, 2, 3}}, X{{1}, {2}, {4}};
  CompletePivotingLu lu;
  lu.factorize(A);
  Matrix found = A * X;
  lu.solve_in_place(found);
  EXPECT_NEAR(found(0, 0) + found(1, 0), 3, 1e-14);
  EXPECT_NEAR(found(2, 0), 4, 1e-14);
  EXPECT_LE(found.cwiseAbs().maxCoeff(), 4 + 1e-14);
}

TEST(CompletePivotingLu, PassesNanOn) {
  Matrix A = Matrix::Identity(3, 3), B = Matrix::Ones(3, 1);
  A(1, 2) = NAN;
  CompletePivotingLu lu;
  lu.factorize(A);
  lu.solve_in_place(B);
  EXPECT_TRUE(B.array().isNaN().all());
}

Matrix solve_consistent(const Matrix& A, Matrix B) {
  ConsistentLu lu;
  lu.factorize(A);
  lu.solve_in_place({B.data(), B.rows(), B.cols()});
  return B;
}

// x_1 + x_2 is determined, x_1 and x_2 are not; the third row has the size of a step of 1e-9 s, and its own unknown.
TEST(ConsistentLu, FindsSomeSolutionOfASingularSystem) {
  const Matrix A{{1, 1, 0, 2}, {3, 3, 0, 1}, {0, 0, 1e-18, 0}, {2, 2, 0, 3}}, X{{1}, {2}, {3}, {4}}, B = A * X;
  const Matrix found = solve_consistent(A, B);
  EXPECT_NEAR(found(0, 0) + found(1, 0), 3, 1e-14);
  EXPECT_NEAR(found(2, 0), 3, 1e-14);
  EXPECT_NEAR(found(3, 0), 4, 1e-14);
  EXPECT_LE(found.cwiseAbs().maxCoeff(), 100) << "nothing of what is free is amplified";
}

// Two equal rows leave a pivot of exactly zero, and 0 / 0 in the estimate of the condition.
TEST(ConsistentLu, FindsSomeSolutionWhereAPivotVanishes) {
  const Matrix A{{1, 0, 0, 1, 0}, {0, 1, 0, -1, 0}, {0, 0, 1, 0, 1}, {1, 1, 0, 0, 0}, {1, 1, 0, 0, 0}},
      X{{1, 0}, {2, 0}, {3, 1}, {4, 0}, {5, 0}}, B = A * X;
  const Matrix found = solve_consistent(A, B);
  EXPECT_LE((A * found - B).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(ConsistentLu, TakesPartialPivotingWhereThatIsEnough) {
  const Matrix A{{2, 1}, {1, 3}}, B{{1}, {2}};
  SmallLu lu;
  lu.factorize(A);
  Matrix expected = B;
  lu.solve_in_place(expected.data());
  EXPECT_EQ(solve_consistent(A, B), expected);
}

TEST(SemidefiniteInverse, IsThePseudoInverse) {
  std::mt19937 random(3);
  SemidefiniteInverse inverse;
  for (const Eigen::Index rank : {0, 1, 3, 6}) {
    const Matrix L = random_matrix(6, rank, random), A = L * L.transpose();
    inverse.factorize(A);
    EXPECT_EQ(inverse.rank(), rank);
    Matrix found = Matrix::Identity(6, 6);
    inverse.apply_in_place(found);
    const Matrix expected = rank > 0 ? pseudo_inverse(A) : A;
    // Rounding times the square of a condition number of up to 1e2.
    EXPECT_LE((found - expected).cwiseAbs().maxCoeff(), 1e-11 * (1 + expected.cwiseAbs().maxCoeff())) << rank;
  }
}

// Contacts of bodies of 1 mg and of 1000 t: the rank does not depend on their units.
TEST(SemidefiniteInverse, FindsTheRankInAllUnits) {
  const Matrix A = Vector{{1e12, 1, 1e-12}}.asDiagonal();
  SemidefiniteInverse inverse;
  inverse.factorize(A);
  EXPECT_EQ(inverse.rank(), 3);
  Matrix B = A;
  inverse.apply_in_place(B);
  EXPECT_LE((B - Matrix::Identity(3, 3)).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(SemidefiniteInverse, PassesNanOn) {
  Matrix A = Matrix::Identity(2, 2), B = Matrix::Ones(2, 1);
  A(0, 0) = NAN;
  SemidefiniteInverse inverse;
  inverse.factorize(A);
  inverse.apply_in_place(B);
  EXPECT_TRUE(B.array().isNaN().all());
}

}  // namespace
}  // namespace ricochet
