#include "methods/control/shooting/horizon_qp.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "bench/measure/allocations.h"
#include "methods/complementarity/lemke.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kHard = std::numeric_limits<double>::infinity();

/// What a random horizon has besides dynamics and costs.
struct QpSizes {
  int N = 5, n_x = 3, n_u = 2;
  int m = 2, p = 0;       ///< inequalities per stage, and terminal equalities
  double weight = kHard;  ///< of the inequalities
  double slack = 1;       ///< mean of d: with negative values few of them hold at z = 0
  double bound = kHard;   ///< of |du|
  std::vector<FreeInitialComponent> free = {};
};

/// Entries of order one; dynamics that neither grow nor vanish over some tens of stages.
HorizonQp random_qp(const QpSizes& sizes, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto matrix = [&](int rows, int columns) -> Matrix {
    return Matrix::NullaryExpr(rows, columns, [&] { return normal(random); });
  };
  const int n_x = sizes.n_x, n_u = sizes.n_u, n_z = n_x + n_u, m = sizes.m;
  HorizonQp qp;
  for (int k = 0; k < sizes.N; ++k) {
    HorizonStage stage;
    stage.A = matrix(n_x, n_x);
    stage.A *= 1.05 / stage.A.eigenvalues().cwiseAbs().maxCoeff();
    stage.B = matrix(n_x, n_u);
    stage.c = matrix(n_x, 1);
    const Matrix root = matrix(n_z, n_z - 1);  // positive semidefinite only
    stage.H = root * root.transpose();
    stage.H.bottomRightCorner(n_u, n_u) += 0.1 * Matrix::Identity(n_u, n_u);
    stage.g = matrix(n_z, 1);
    stage.C = matrix(m, n_z);
    stage.d = (matrix(m, 1).array() + sizes.slack).matrix();
    stage.weight = Vector::Constant(m, sizes.weight);
    stage.lower = Vector::Constant(n_u, -sizes.bound);
    stage.upper = Vector::Constant(n_u, sizes.bound);
    qp.stages.push_back(std::move(stage));
  }
  const Matrix root = matrix(n_x, n_x);
  qp.end = {root * root.transpose(),
            matrix(n_x, 1),
            matrix(m, n_x),
            (matrix(m, 1).array() + sizes.slack).matrix(),
            Vector::Constant(m, sizes.weight),
            matrix(sizes.p, n_x),
            matrix(sizes.p, 1),
            Vector::Constant(sizes.p, 1e3)};
  qp.dx_0 = matrix(n_x, 1);
  qp.free = sizes.free;
  for (const FreeInitialComponent& component : qp.free) qp.dx_0[component.index] = std::nan("");
  return qp;
}

/// The same program without its states: every dx_k = X_k theta + x_k with theta = (free components, all du).
struct CondensedQp {
  Matrix H;
  Vector g;
  Matrix G;  ///< rows G theta + d >= 0
  Vector d, weight;
  std::vector<Matrix> X;
  std::vector<Vector> x;
  std::vector<Matrix> U;  ///< du_k = U_k theta

  explicit CondensedQp(const HorizonQp& qp) {
    const int n_x = qp.n_x(), n_free = static_cast<int>(qp.free.size());
    int n = n_free;
    for (const HorizonStage& stage : qp.stages) n += static_cast<int>(stage.B.cols());
    H.setZero(n, n);
    g.setZero(n);
    Matrix X_k = Matrix::Zero(n_x, n);
    Vector x_k = qp.dx_0;
    for (int j = 0; j < n_free; ++j) {
      const FreeInitialComponent& component = qp.free[j];
      X_k(component.index, j) = 1;
      x_k[component.index] = 0;
      add_bounds(Matrix(Vector::Unit(n, j).transpose()), component.lower, component.upper);
    }
    int first = n_free;
    for (const HorizonStage& stage : qp.stages) {
      const int n_u = static_cast<int>(stage.B.cols());
      Matrix U_k = Matrix::Zero(n_u, n);
      U_k.middleCols(first, n_u).setIdentity();
      first += n_u;
      Matrix Z(n_x + n_u, n);
      Z << X_k, U_k;
      Vector z = Vector::Zero(n_x + n_u);
      z.head(n_x) = x_k;
      add_cost(stage.H, stage.g, Z, z);
      add_rows(stage.C * Z, stage.C * z + stage.d, stage.weight);
      for (int i = 0; i < n_u; ++i) add_bounds(U_k.row(i), stage.lower[i], stage.upper[i]);
      X.push_back(X_k);
      x.push_back(x_k);
      U.push_back(U_k);
      X_k = stage.A * X_k + stage.B * U_k;
      x_k = stage.A * x_k + stage.c;
    }
    X.push_back(X_k);
    x.push_back(x_k);
    add_cost(qp.end.H, qp.end.g, X_k, x_k);
    add_rows(qp.end.C * X_k, qp.end.C * x_k + qp.end.d, qp.end.weight);
    const Matrix E = qp.end.E * X_k;
    const Vector r = qp.end.E * x_k + qp.end.r;
    add_rows(E, r, qp.end.E_weight);  // |v| as the slacks of v >= 0 and of -v >= 0
    add_rows(-E, -r, qp.end.E_weight);
  }

  void add_cost(const Matrix& stage_H, const Vector& stage_g, const Matrix& Z, const Vector& z) {
    H += Z.transpose() * stage_H * Z;
    g += Z.transpose() * (stage_H * z + stage_g);
    constant += 0.5 * z.dot(stage_H * z) + stage_g.dot(z);
  }
  void add_rows(const Matrix& rows, const Vector& values, const Vector& weights) {
    const Eigen::Index m = d.size();
    G.conservativeResize(m + rows.rows(), H.cols());
    d.conservativeResize(m + rows.rows());
    weight.conservativeResize(m + rows.rows());
    G.bottomRows(rows.rows()) = rows;
    d.tail(rows.rows()) = values;
    weight.tail(rows.rows()) = weights;
  }
  void add_bounds(const Matrix& row, double lower, double upper) {
    if (lower > -kHard) add_rows(row, Vector::Constant(1, -lower), Vector::Constant(1, kHard));
    if (upper < kHard) add_rows(-row, Vector::Constant(1, upper), Vector::Constant(1, kHard));
  }
  double cost(const Vector& theta) const { return 0.5 * theta.dot(H * theta) + g.dot(theta) + constant; }
  double penalty(const Vector& theta) const {
    const Vector v = G * theta + d;
    double sum = 0;
    for (Eigen::Index i = 0; i < v.size(); ++i)
      if (weight[i] < kHard) sum += weight[i] * std::max(0.0, -v[i]);
    return sum;
  }

  /// The solution by pivoting. With theta = H^-1 (G' y - g), the conditions of optimality are the linear
  /// complementarity problem 0 <= y _|_ G theta + d + s >= 0, 0 <= s _|_ weight - y >= 0.
  Vector solve() const {
    const Eigen::FullPivLU<Matrix> lu(H);
    const Eigen::Index m = d.size();
    std::vector<Eigen::Index> soft;
    for (Eigen::Index i = 0; i < m; ++i)
      if (weight[i] < kHard) soft.push_back(i);
    const Eigen::Index size = m + static_cast<Eigen::Index>(soft.size());
    if (m == 0) return lu.solve(-g);
    Matrix M = Matrix::Zero(size, size);
    Vector q(size), y(size);
    M.topLeftCorner(m, m) = G * lu.solve(G.transpose());
    q.head(m) = d - G * lu.solve(g);
    for (std::size_t j = 0; j < soft.size(); ++j) {
      const Eigen::Index row = m + static_cast<Eigen::Index>(j);
      M(soft[j], row) = 1;
      M(row, soft[j]) = -1;
      q[row] = weight[soft[j]];
    }
    LemkeSolver lemke(static_cast<int>(size));
    EXPECT_EQ(lemke.solve(M, q, y), LcpStatus::solved);
    return lu.solve(G.transpose() * y.head(m) - g);
  }

  double constant = 0;
};

/// Where a bound is nearly active, the error of du is the square root of that of the complementarity, 1e-12.
constexpr double kSame = 1e-6;

/// The conditions of optimality, written again from the definition of the program.
void expect_optimal(const HorizonQp& qp, const HorizonQpSolution& solution, double tolerance) {
  const std::size_t N = qp.stages.size();
  const auto expect_zero = [&](const Vector& v, const char* what, std::size_t k) {
    EXPECT_LE(v.lpNorm<Eigen::Infinity>(), tolerance) << what << " " << k;
  };
  const auto expect_pair = [&](double y, double t, const char* what, std::size_t k) {
    EXPECT_GE(y, -tolerance) << what << " " << k;
    EXPECT_GE(t, -tolerance) << what << " " << k;
    EXPECT_LE(std::min(y, 1.0) * std::min(t, 1.0), tolerance) << what << " " << k;
  };
  for (std::size_t k = 0; k <= N; ++k) {
    const bool is_end = k == N;
    Vector z = solution.dx[k], slope;
    const Matrix& C = is_end ? qp.end.C : qp.stages[k].C;
    const Vector& d = is_end ? qp.end.d : qp.stages[k].d;
    const Vector& weight = is_end ? qp.end.weight : qp.stages[k].weight;
    if (is_end) {
      slope = qp.end.H * z + qp.end.g - qp.end.E.transpose() * solution.y_E;
    } else {
      const HorizonStage& stage = qp.stages[k];
      z.conservativeResize(z.size() + solution.du[k].size());
      z.tail(solution.du[k].size()) = solution.du[k];
      slope = stage.H * z + stage.g;
      slope.head(qp.n_x()) += stage.A.transpose() * solution.lambda[k + 1];
      slope.tail(solution.du[k].size()) +=
          stage.B.transpose() * solution.lambda[k + 1] - solution.y_lower[k] + solution.y_upper[k];
      expect_zero(stage.A * solution.dx[k] + stage.B * solution.du[k] + stage.c - solution.dx[k + 1], "dynamics", k);
      for (Eigen::Index i = 0; i < solution.du[k].size(); ++i) {
        EXPECT_GE(solution.du[k][i], stage.lower[i]);
        EXPECT_LE(solution.du[k][i], stage.upper[i]);
        expect_pair(solution.y_lower[k][i], solution.du[k][i] - stage.lower[i], "lower bound", k);
        expect_pair(solution.y_upper[k][i], stage.upper[i] - solution.du[k][i], "upper bound", k);
      }
    }
    slope -= C.transpose() * solution.y[k];
    slope.head(qp.n_x()) -= solution.lambda[k];
    expect_zero(slope, "stationarity", k);
    const Vector v = C * z + d + solution.slack[k];
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      expect_pair(solution.y[k][i], v[i], "inequality", k);
      if (weight[i] < kHard)
        expect_pair(weight[i] - solution.y[k][i], solution.slack[k][i], "slack", k);
      else
        EXPECT_EQ(solution.slack[k][i], 0);
    }
  }
}

/// @return the solution, which agrees with that by pivoting
HorizonQpSolution expect_same_as_dense(const HorizonQp& qp) {
  HorizonQpSolver solver;
  const HorizonQpSolution solution = solver.solve(qp, {.tolerance = 1e-12});
  EXPECT_TRUE(solution.is_solved()) << solution.message;
  EXPECT_LE(solution.iterations, 40);  // 20 is the most that was seen
  const CondensedQp dense(qp);
  const Vector theta = dense.solve();
  const double size = 1 + theta.lpNorm<Eigen::Infinity>();
  for (std::size_t k = 0; k < qp.stages.size(); ++k)
    EXPECT_LE((solution.du[k] - dense.U[k] * theta).lpNorm<Eigen::Infinity>(), kSame * size) << k;
  for (std::size_t k = 0; k <= qp.stages.size(); ++k)
    EXPECT_LE((solution.dx[k] - dense.X[k] * theta - dense.x[k]).lpNorm<Eigen::Infinity>(), kSame * size) << k;
  const double cost = dense.cost(theta), penalty = dense.penalty(theta);
  EXPECT_NEAR(solution.cost, cost, kSame * (1 + std::abs(cost)));
  EXPECT_NEAR(solution.penalty, penalty, kSame * (1 + std::abs(cost) + penalty));
  expect_optimal(qp, solution, kSame * size);
  return solution;
}

struct QpCase {
  const char* name;
  QpSizes sizes;
};

class RandomHorizon : public testing::TestWithParam<QpCase> {};

TEST_P(RandomHorizon, HasTheSolutionOfTheDenseProgram) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    expect_same_as_dense(random_qp(GetParam().sizes, seed));
    if (testing::Test::HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(
    HorizonQp, RandomHorizon,
    testing::Values(QpCase{"without_inequalities", {.m = 0}}, QpCase{"one_stage", {.N = 1, .slack = 8, .bound = 0.5}},
                    QpCase{"hard_inequalities", {.N = 6, .slack = 8}},
                    QpCase{"cheap_slacks", {.N = 8, .weight = 2, .slack = -1}},
                    QpCase{"dear_slacks", {.N = 6, .m = 3, .weight = 1e4, .slack = -1, .bound = 1}},
                    QpCase{"bounds", {.N = 10, .m = 0, .bound = 0.1}},
                    QpCase{"small_trust_region", {.N = 10, .m = 1, .weight = 100, .bound = 1e-5}},
                    QpCase{"terminal_equalities", {.N = 5, .m = 0, .p = 2}},
                    QpCase{"more_equalities_than_controls", {.N = 1, .n_u = 1, .m = 0, .p = 3, .bound = 2}},
                    QpCase{"free_component", {.N = 6, .m = 1, .weight = 50, .bound = 1, .free = {{1, -0.3, 0.2}}}},
                    QpCase{"free_components",
                           {.N = 4, .m = 2, .p = 1, .weight = 50, .free = {{2, -kHard, kHard}, {0, 0.1, kHard}}}},
                    QpCase{
                        "everything",
                        {.N = 12, .n_x = 4, .n_u = 2, .m = 3, .p = 2, .weight = 10, .bound = 1, .free = {{3, -1, 1}}}}),
    [](const auto& test) { return std::string(test.param.name); });

/// One state x and one control u with x_k+1 = x_k + u_k and the cost 1/2 (x^2 + u^2) of every stage.
HorizonQp integrator(int N, double x_0) {
  HorizonStage stage{
      Matrix::Ones(1, 1), Matrix::Ones(1, 1), Vector::Zero(1), Matrix::Identity(2, 2),      Vector::Zero(2),
      Matrix(0, 2),       Vector(0),          Vector(0),       Vector::Constant(1, -kHard), Vector::Constant(1, kHard)};
  HorizonQp qp;
  qp.stages.assign(N, stage);
  qp.end = {Matrix::Identity(1, 1), Vector::Zero(1), Matrix(0, 1), Vector(0), Vector(0),
            Matrix(0, 1),           Vector(0),       Vector(0)};
  qp.dx_0 = Vector::Constant(1, x_0);
  return qp;
}

HorizonQpSolution solution_of(const HorizonQp& qp, const HorizonQpOptions& options = {}) {
  return HorizonQpSolver().solve(qp, options);
}

/// The stationary gain and cost of the Riccati equation P = 1 + P / (1 + P), the golden ratio.
TEST(HorizonQp, HasTheRiccatiGain) {
  const double golden = 0.5 * (1 + std::sqrt(5.0));
  const HorizonQpSolution solution = solution_of(integrator(40, 1));
  ASSERT_TRUE(solution.is_solved());
  const double regularised = 1e-12;  // size of the proximal term
  EXPECT_NEAR(solution.K[0](0, 0), -golden / (1 + golden), regularised);
  EXPECT_NEAR(solution.cost, 0.5 * golden, 1e-14);
  EXPECT_NEAR(solution.lambda[0][0], golden, regularised);
}

/// A contradiction, x_1 >= 1 and x_1 <= -1, is paid for at the lower weight; the multiplier of a violated row is its weight.
TEST(HorizonQp, PaysForAContradictionOnlyAsMuchAsItMust) {
  HorizonQp qp = integrator(3, 0);
  qp.stages[1].C.resize(2, 2);
  qp.stages[1].C << 1, 0, -1, 0;
  qp.stages[1].d = Vector::Constant(2, -1);
  qp.stages[1].weight = Vector{{20.0, 1000.0}};
  const HorizonQpSolution solution = expect_same_as_dense(qp);
  EXPECT_NEAR(solution.dx[1][0], -1, 1e-9);
  EXPECT_NEAR(solution.slack[1][0], 2, 1e-9);
  EXPECT_NEAR(solution.y[1][0], 20, 1e-9);
  EXPECT_NEAR(solution.penalty, 40, 1e-7);

  qp.stages[1].weight.setConstant(kHard);
  const HorizonQpSolution hard = solution_of(qp);
  EXPECT_EQ(hard.status, QpStatus::infeasible) << hard.message;
  EXPECT_TRUE(hard.dx[1].allFinite() && hard.du[1].allFinite());
}

/// Hard inequalities that the bounds do not allow to fulfil.
TEST(HorizonQp, ReportsBoundsThatContradictInequalities) {
  HorizonQp qp = integrator(4, 0);
  for (HorizonStage& stage : qp.stages) stage.lower[0] = -0.1, stage.upper[0] = 0.1;
  qp.end.C = Matrix::Ones(1, 1);
  qp.end.d = Vector::Constant(1, -0.5);
  qp.end.weight = Vector::Constant(1, kHard);
  EXPECT_EQ(solution_of(qp).status, QpStatus::infeasible);
  qp.end.d[0] = -0.4;  // only du = 0.1 throughout: no interior
  const HorizonQpSolution solution = solution_of(qp);
  if (solution.is_solved()) EXPECT_NEAR(solution.dx[4][0], 0.4, 1e-9);
  qp.end.d[0] = -0.39;
  ASSERT_TRUE(solution_of(qp).is_solved());
  qp.end.d[0] = -0.5;
  qp.end.weight[0] = 1e6;
  const HorizonQpSolution soft = expect_same_as_dense(qp);
  EXPECT_NEAR(soft.slack[4][0], 0.1, 1e-9);
}

/// lambda is the slope of the optimal cost: of dx_0 here, with inequalities and bounds that stay active or inactive.
TEST(HorizonQp, HasTheSlopeOfTheCostAsMultiplier) {
  HorizonQp qp = random_qp({.N = 6, .m = 2, .p = 1, .weight = 3, .bound = 0.5}, 3);
  const Vector lambda = solution_of(qp, {.tolerance = 1e-12}).lambda[0];
  for (int i = 0; i < qp.n_x(); ++i) {
    const double step = 1e-4;
    const auto value = [&](double change) {
      HorizonQp moved = qp;
      moved.dx_0[i] += change;
      const HorizonQpSolution solution = solution_of(moved, {.tolerance = 1e-12});
      return solution.cost + solution.penalty;
    };
    EXPECT_NEAR((value(step) - value(-step)) / (2 * step), lambda[i], 1e-5 * (1 + std::abs(lambda[i]))) << i;
  }
}

/// The first value of a state with identity dynamics, as a free end time is: it enters every stage through A.
TEST(HorizonQp, HasAFreeParameter) {
  QpSizes sizes{.N = 8, .n_x = 4, .m = 1, .weight = 20, .bound = 2, .free = {{3, -0.5, 0.5}}};
  for (unsigned seed = 1; seed <= 10; ++seed) {
    HorizonQp qp = random_qp(sizes, seed);
    for (HorizonStage& stage : qp.stages) {
      stage.A.row(3).setZero();
      stage.A(3, 3) = 1;
      stage.B.row(3).setZero();
      stage.c[3] = 0;
    }
    const HorizonQpSolution solution = expect_same_as_dense(qp);
    for (const Vector& dx : solution.dx) EXPECT_NEAR(dx[3], solution.dx[0][3], 1e-12);
    EXPECT_NEAR(solution.lambda[0][3], solution.y_free_lower[0] - solution.y_free_upper[0], 1e-8);
  }
}

TEST(HorizonQp, KeepsFixedControlsAndComponents) {
  HorizonQp qp = random_qp({.N = 5, .m = 2, .weight = 5, .bound = 1, .free = {{0, 0.25, 0.25}}}, 7);
  qp.stages[2].lower[1] = qp.stages[2].upper[1] = -0.3;
  const HorizonQpSolution solution = solution_of(qp);
  ASSERT_TRUE(solution.is_solved()) << solution.message;
  EXPECT_EQ(solution.du[2][1], -0.3);
  EXPECT_EQ(solution.dx[0][0], 0.25);
  EXPECT_TRUE(solution.K[2].row(1).isZero(0));
  expect_optimal(qp, solution, kSame);
}

/// The last values of the sweeps are the derivative of the optimal control by the state, if no row is nearly active.
TEST(HorizonQp, HasTheFeedbackOfTheSolution) {
  const HorizonQp qp = random_qp({.N = 6, .m = 1, .weight = 5, .bound = 0.6}, 4);
  const HorizonQpOptions precise{.tolerance = 1e-12};
  const HorizonQpSolution solution = solution_of(qp, precise);
  const double step = 1e-5;
  for (int i = 0; i < qp.n_x(); ++i) {
    HorizonQp moved = qp;
    moved.dx_0[i] += step;
    const Vector slope = (solution_of(moved, precise).du[0] - solution.du[0]) / step;
    EXPECT_LE((slope - solution.K[0].col(i)).lpNorm<Eigen::Infinity>(), 1e-4) << i;
  }
}

TEST(HorizonQp, HasGainsWithoutBounds) {
  HorizonQp qp = random_qp({.N = 6, .m = 0, .bound = 1e-3}, 5);
  qp.stages[3].upper[0] = qp.stages[3].lower[0];
  const HorizonQpSolution tight = solution_of(qp, {.gains_without_bounds = true});
  for (HorizonStage& stage : qp.stages) stage.lower.setConstant(-kHard), stage.upper.setConstant(kHard);
  const HorizonQpSolution free = solution_of(qp);
  ASSERT_TRUE(tight.is_solved() && free.is_solved());
  for (std::size_t k = 0; k < 6; ++k) EXPECT_TRUE(tight.K[k].isApprox(free.K[k], 1e-10)) << k;
}

/// No curvature in the controls at all, or only in their sum.
TEST(HorizonQp, SolvesProgramsWithoutCurvatureInTheControls) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    HorizonQp linear = random_qp({.N = 5, .m = 1, .weight = 3, .bound = 1}, seed);
    for (HorizonStage& stage : linear.stages) stage.H.setZero();
    linear.end.H.setZero();
    const HorizonQpSolution solution = solution_of(linear);
    ASSERT_TRUE(solution.is_solved()) << seed << ": " << solution.message;
    expect_optimal(linear, solution, kSame);

    HorizonQp twins = random_qp({.N = 5, .m = 0}, seed);
    for (HorizonStage& stage : twins.stages) {  // two controls that do the same
      stage.B.col(1) = stage.B.col(0);
      stage.H.setIdentity();
      stage.H.bottomRightCorner(2, 2).setZero();
      stage.g.tail(2).setZero();
    }
    const HorizonQpSolution same = solution_of(twins);
    ASSERT_TRUE(same.is_solved()) << seed << ": " << same.message;
    expect_optimal(twins, same, kSame);
  }
}

/// Without feedback, rounding would grow by 2^60.
TEST(HorizonQp, SolvesUnstableDynamics) {
  HorizonQp qp = integrator(60, 1);
  for (HorizonStage& stage : qp.stages) {
    stage.A(0, 0) = 2;
    stage.c[0] = 0.1;
    stage.lower[0] = -1.5;
    stage.upper[0] = 1.5;
  }
  const HorizonQpSolution solution = solution_of(qp);
  ASSERT_TRUE(solution.is_solved()) << solution.message;
  expect_optimal(qp, solution, kSame);
  EXPECT_LE(solution.dx[30].norm(), 1);
}

TEST(HorizonQp, ReportsWhatHasNoSolution) {
  HorizonQp concave = integrator(3, 1);
  concave.stages[1].H(1, 1) = -5;
  EXPECT_EQ(solution_of(concave).status, QpStatus::not_convex);
  HorizonQp bounded = concave;  // also where bounds make every direction a stable one for the barrier
  bounded.stages[1].lower[0] = -1;
  bounded.stages[1].upper[0] = 1;
  EXPECT_EQ(solution_of(bounded).status, QpStatus::not_convex);
  HorizonQp endless = integrator(3, 1);
  for (HorizonStage& stage : endless.stages) stage.H.setZero(), stage.g.setOnes();
  endless.end.H.setZero();
  EXPECT_FALSE(solution_of(endless).is_solved());
  for (double HorizonQpOptions::*option : {&HorizonQpOptions::tolerance}) {
    HorizonQpOptions options;
    options.*option = 1e-14;
    options.max_iterations = 1;
    const HorizonQpSolution early = solution_of(random_qp({.bound = 0.1}, 1), options);
    EXPECT_EQ(early.status, QpStatus::iteration_limit);
    EXPECT_EQ(early.iterations, 1);
  }
}

TEST(HorizonQp, ReportsNumbersThatAreNotFinite) {
  const HorizonQp good = random_qp({.p = 1, .weight = 3, .bound = 1, .free = {{0, -1, 1}}}, 1);
  ASSERT_TRUE(solution_of(good).is_solved());
  const auto spoil = [&](const auto& change) {
    for (const double value : {std::nan(""), -kHard}) {
      HorizonQp qp = good;
      change(qp, value);
      const HorizonQpSolution solution = solution_of(qp);
      EXPECT_EQ(solution.status, QpStatus::non_finite) << solution.message;
      EXPECT_STRNE(solution.message, "");
    }
  };
  spoil([](HorizonQp& qp, double value) { qp.stages[1].A(0, 0) = value; });
  spoil([](HorizonQp& qp, double value) { qp.stages[1].B(0, 0) = value; });
  spoil([](HorizonQp& qp, double value) { qp.stages[4].c[0] = value; });
  spoil([](HorizonQp& qp, double value) { qp.stages[0].H(1, 0) = value; });
  spoil([](HorizonQp& qp, double value) { qp.stages[0].g[2] = value; });
  spoil([](HorizonQp& qp, double value) { qp.stages[0].C(1, 1) = value; });
  spoil([](HorizonQp& qp, double value) { qp.stages[0].d[1] = value; });
  spoil([](HorizonQp& qp, double value) { qp.end.H(1, 0) = value; });
  spoil([](HorizonQp& qp, double value) { qp.end.g[2] = value; });
  spoil([](HorizonQp& qp, double value) { qp.end.E(0, 0) = value; });
  spoil([](HorizonQp& qp, double value) { qp.end.r[0] = value; });
  spoil([](HorizonQp& qp, double value) { qp.dx_0[1] = value; });
  HorizonQp qp = good;
  for (double* entry : {&qp.stages[0].lower[0], &qp.stages[0].weight[0], &qp.end.E_weight[0], &qp.free[0].upper}) {
    const double kept = std::exchange(*entry, std::nan(""));
    EXPECT_EQ(solution_of(qp).status, QpStatus::non_finite);
    *entry = kept;
  }
}

TEST(HorizonQp, RejectsBadInput) {
  const HorizonQp good = random_qp({.p = 1, .weight = 3, .bound = 1, .free = {{0, -1, 1}}}, 1);
  const auto expect_error = [&](const auto& change, const char* text) {
    HorizonQp qp = good;
    HorizonQpOptions options;
    change(qp, options);
    try {
      solution_of(qp, options);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  };
  expect_error([](HorizonQp& qp, auto&) { qp.stages.clear(); }, "stages = 0: at least one is required");
  expect_error([](HorizonQp& qp, auto&) { qp.stages[2].B.resize(2, 2); }, "B of stage 2 = 2 x 2: 3 x 2 is required");
  expect_error([](HorizonQp& qp, auto&) { qp.stages[2].weight.resize(1); }, "weight of stage 2 = 1 x 1: 2 x 1");
  expect_error([](HorizonQp& qp, auto&) { qp.stages[1].weight[0] = 0; }, "weight of stage 1 = 0: a number > 0");
  expect_error([](HorizonQp& qp, auto&) { qp.end.E_weight[0] = kHard; }, "E_weight of stage 5 = inf: a finite number");
  expect_error([](HorizonQp& qp, auto&) { qp.stages[3].lower[1] = 2; }, "bounds of du of stage 3 = [2, 1]");
  expect_error([](HorizonQp& qp, auto&) { qp.free[0].index = 3; }, "free component of dx_0 = 3: 0 to 2 is required");
  expect_error([](HorizonQp& qp, auto&) { qp.free.push_back(qp.free[0]); }, "it is listed twice");
  expect_error([](auto&, HorizonQpOptions& options) { options.tolerance = 0; }, "tolerance = 0: a number between");
  expect_error([](auto&, HorizonQpOptions& options) { options.max_iterations = 0; }, "max_iterations = 0");
}

/// Operations are linear in N: a constant number of factorisations per stage and iteration, and no more iterations.
TEST(HorizonQp, NeedsOperationsThatAreLinearInTheHorizon) {
  for (const int N : {10, 40, 160, 640}) {
    const HorizonQpSolution solution = solution_of(random_qp({.N = N, .m = 2, .weight = 10, .bound = 1}, 11));
    ASSERT_TRUE(solution.is_solved()) << N;
    EXPECT_LE(solution.iterations, 25) << N;  // 11 to 15 were seen
    EXPECT_EQ(solution.factorisations, N * (solution.iterations + 1)) << N;
  }
}

TEST(HorizonQp, AllocatesNothingForTheSameSizes) {
  const QpSizes sizes{.N = 10, .n_x = 8, .n_u = 3, .m = 4, .p = 2, .weight = 10, .bound = 1, .free = {{0, -1, 1}}};
  const HorizonQp first = random_qp(sizes, 1), second = random_qp(sizes, 2);
  HorizonQpSolver solver;
  for (const bool gains_without_bounds : {false, true}) {
    const HorizonQpOptions options{.gains_without_bounds = gains_without_bounds};
    ASSERT_TRUE(solver.solve(first, options).is_solved());
    EXPECT_EQ(allocations_of([&] { EXPECT_TRUE(solver.solve(second, options).is_solved()); }).count, 0);
  }
  const HorizonQpSolution expected = solution_of(second);  // whatever was solved before
  const HorizonQpSolution& again = solver.solve(second);
  for (std::size_t k = 0; k < expected.du.size(); ++k) EXPECT_EQ(again.du[k], expected.du[k]);
}

}  // namespace
}  // namespace ricochet
