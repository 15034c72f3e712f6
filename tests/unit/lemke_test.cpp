#include "methods/complementarity/lemke.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "reference/active_set.h"

namespace ricochet {
namespace {

/// Largest violation of 0 <= z _|_ M z + q >= 0, relative to the terms.
double violation(const Matrix& M, const Vector& q, const Vector& z) {
  const Vector w = M * z + q;
  if (q.isZero(0) && z.isZero(0)) return 0;
  const double w_size = (M.cwiseAbs() * z.cwiseAbs() + q.cwiseAbs()).maxCoeff(), z_size = 1 + z.cwiseAbs().maxCoeff();
  return std::max(
      {-w.minCoeff() / w_size, -z.minCoeff() / z_size, w.cwiseProduct(z).cwiseAbs().maxCoeff() / (w_size * z_size)});
}

/// Up to 12 Gauss-Jordan steps on entries of order one.
constexpr double kEliminationError = 1e-12;

/// Eight contacts of a body with three coordinates: forces that are not unique, among bases that are singular.
TEST(Lemke, SolvesRedundantProblems) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const int n = 8, rank = 3;
  LemkeSolver solver(n);
  for (int trial = 0; trial < 500; ++trial) {
    const Matrix B = Matrix::NullaryExpr(n, rank, [&] { return normal(random); });
    const Vector free = Vector::NullaryExpr(rank, [&] { return normal(random); });
    const Matrix M = B * B.transpose();
    const Vector q = B * free;  // any M z + q is B times something, so z = 0 is beaten by a projection: always solvable
    Vector z(n);
    ASSERT_EQ(solver.solve(M, q, z), LcpStatus::solved) << trial;
    ASSERT_LE(violation(M, q, z), kEliminationError) << trial;
  }
}

/// Pressed down and pushed sideways, on a polygon of four corners with friction: the LCP of velocity-level stepping.
TEST(Lemke, SolvesABoxOnFourCorners) {
  const int facets = 8, corners = 4, n = corners * (facets + 2);
  Matrix D(6, corners * (facets + 1));  // directions in terms of velocity and spin of a unit body
  Matrix M = Matrix::Zero(n, n);
  for (int k = 0; k < corners; ++k) {
    const Eigen::Vector3d arm((k & 1) ? 1 : -1, (k & 2) ? 1 : -1, -0.5);
    const auto direction = [&](const Eigen::Vector3d& e) {
      Vector column(6);
      column << e, arm.cross(e);
      return column;
    };
    D.col(k) = direction({0, 0, 1});
    for (int f = 0; f < facets; ++f) {
      const double angle = 2 * std::numbers::pi * f / facets;
      D.col(corners + k * facets + f) = direction({std::cos(angle), std::sin(angle), 0});
    }
  }
  const auto columns = D.cols();
  M.topLeftCorner(columns, columns) = D.transpose() * D;
  for (int k = 0; k < corners; ++k) {
    M(columns + k, k) = 0.5;
    M.block(corners + k * facets, columns + k, facets, 1).setOnes();
    M.block(columns + k, corners + k * facets, 1, facets).setConstant(-1);
  }
  LemkeSolver solver(n);
  for (const double push : {0.0, 0.1, 0.45, 0.6, 3.0}) {
    Vector v(6), q = Vector::Zero(n), z(n);
    v << push, 0.3 * push, -1, 0, 0, 0.2 * push;
    q.head(columns) = D.transpose() * v;
    ASSERT_EQ(solver.solve(M, q, z), LcpStatus::solved) << push;
    EXPECT_LE(violation(M, q, z), kEliminationError) << push;
  }
}

TEST(Lemke, SolvesRandomPositiveDefiniteProblems) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int n = 1; n <= 12; ++n) {
    LemkeSolver solver(n);
    for (int trial = 0; trial < 200; ++trial) {
      const Matrix B = Matrix::NullaryExpr(n, n, [&] { return normal(random); });
      const Matrix M = B * B.transpose() + 0.1 * Matrix::Identity(n, n);
      const Vector q = Vector::NullaryExpr(n, [&] { return normal(random); });
      Vector z(n);
      ASSERT_EQ(solver.solve(M, q, z), LcpStatus::solved);
      ASSERT_LE(violation(M, q, z), kEliminationError);
      if (n <= 6) {
        const auto enumerated = reference::solve_lcp_by_enumeration(M, q);
        ASSERT_TRUE(enumerated);
        ASSERT_LE((z - *enumerated).cwiseAbs().maxCoeff(), 1e-9 * (1 + z.maxCoeff()))
            << "M is a P-matrix: the solution is unique; cond(M) up to 1e3";
      }
    }
  }
}

/// The friction problem of a point on a plane: copositive, degenerate, redundant facets.
struct PointOnPlane {
  Matrix D, M;
  explicit PointOnPlane(int facets, double mu = 0.35, double mass = 1.2) {
    const int n = facets + 2;
    D.setZero(3, facets + 1);
    D(2, 0) = 1;
    for (int f = 0; f < facets; ++f) {
      D(0, 1 + f) = std::cos(2 * M_PI * f / facets);
      D(1, 1 + f) = std::sin(2 * M_PI * f / facets);
    }
    M.setZero(n, n);
    M.topLeftCorner(facets + 1, facets + 1) = D.transpose() * D / mass;
    M(n - 1, 0) = mu;
    M.block(1, n - 1, facets, 1).setOnes();
    M.block(n - 1, 1, 1, facets).setConstant(-1);
  }
  Vector q(const Eigen::Vector3d& v) const {
    Vector result = Vector::Zero(M.rows());
    result.head(D.cols()) = D.transpose() * v;
    return result;
  }
};

TEST(Lemke, SolvesDegenerateFrictionProblems) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::uniform_int_distribution<int> exponent(0, 19);
  for (const int facets : {4, 8, 16}) {
    const PointOnPlane problem(facets);
    LemkeSolver solver(facets + 2);
    for (int trial = 0; trial < 3000; ++trial) {
      const double scale = std::pow(10, -exponent(random));
      Eigen::Vector3d v(scale * uniform(random), scale * uniform(random), -0.0098);
      if (trial % 3 == 0) v[2] = 0;
      if (trial % 3 == 1) v[2] = -1e-17;
      if (trial % 7 == 0) v.head<2>().setZero();
      const Vector q = problem.q(v);
      Vector z(facets + 2);
      ASSERT_EQ(solver.solve(problem.M, q, z), LcpStatus::solved) << facets << " facets, v = " << v.transpose();
      ASSERT_LE(violation(problem.M, q, z), kEliminationError) << facets << " facets, v = " << v.transpose();
    }
  }
}

TEST(Lemke, TiesEndToo) {
  // Every ratio is a tie: n equal rows.
  const int n = 8;
  const Matrix M = Matrix::Ones(n, n) + 1e-3 * Matrix::Identity(n, n);
  Vector z(n);
  LemkeSolver solver(n);
  EXPECT_EQ(solver.solve(M, -Vector::Ones(n), z), LcpStatus::solved);
  EXPECT_LE(violation(M, -Vector::Ones(n), z), kEliminationError);
  EXPECT_LE(solver.pivots(), 2 * n);
}

TEST(Lemke, SaysWhenThereIsNoSolution) {
  Matrix M(1, 1);
  M << -1;
  Vector z(1);
  EXPECT_EQ(LemkeSolver(1).solve(M, Vector::Constant(1, -1), z), LcpStatus::ray);
}

TEST(Lemke, NonNegativeRightHandSideNeedsNoPivot) {
  LemkeSolver solver(2);
  Vector z(2);
  EXPECT_EQ(solver.solve(Matrix::Identity(2, 2), Vector::Ones(2), z), LcpStatus::solved);
  EXPECT_EQ(z, Vector(Vector::Zero(2)));
  EXPECT_EQ(solver.pivots(), 0);
}

TEST(Lemke, WarmStartNeedsNoPivotWhenTheActiveSetStays) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const int n = 6;
  const Matrix B = Matrix::NullaryExpr(n, n, [&] { return normal(random); });
  const Matrix M = B * B.transpose() + Matrix::Identity(n, n);
  const Vector q = Vector::NullaryExpr(n, [&] { return normal(random); });
  LemkeSolver solver(n);
  Vector z = Vector::Zero(n), cold(n);
  ASSERT_EQ(solver.solve(M, q, cold), LcpStatus::solved);
  z = cold;
  const Vector moved = q * 1.001;
  EXPECT_EQ(solver.solve_warm(M, moved, z), LcpStatus::solved);
  EXPECT_EQ(solver.pivots(), 0);
  EXPECT_LE(violation(M, moved, z), kEliminationError);
}

TEST(Lemke, WarmStartFromAWrongActiveSetStillSolves) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const int n = 5;
  LemkeSolver solver(n);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix B = Matrix::NullaryExpr(n, n, [&] { return normal(random); });
    const Matrix M = B * B.transpose() + 0.1 * Matrix::Identity(n, n);
    const Vector q = Vector::NullaryExpr(n, [&] { return normal(random); });
    Vector z = Vector::NullaryExpr(n, [&] { return std::max(0.0, normal(random)); });
    ASSERT_EQ(solver.solve_warm(M, q, z), LcpStatus::solved);
    ASSERT_LE(violation(M, q, z), kEliminationError);
  }
}

TEST(Enumeration, FindsTheKnownSolution) {
  Matrix M(2, 2);
  M << 2, 1, 1, 2;
  const auto z = reference::solve_lcp_by_enumeration(M, Eigen::Vector2d(-5, -6));
  ASSERT_TRUE(z);
  EXPECT_NEAR((*z)[0], 4.0 / 3, 1e-15);
  EXPECT_NEAR((*z)[1], 7.0 / 3, 1e-15);
}

}  // namespace
}  // namespace ricochet
