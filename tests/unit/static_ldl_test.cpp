#include "methods/complementarity/mpcc/static_ldl.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include "bench/control/control_options.h"
#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/complementarity/mpcc/ipopt_ldl.h"
#include "methods/complementarity/mpcc/ipopt_solver.h"
#include "problems/input_error.h"
#include "tests/nlp_blocks.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Positions are counted from 1.
struct Entries {
  int n = 0, n_rows = 0;
  std::vector<int> rows = {}, columns = {};
  std::vector<double> values = {};

  void add(int row, int column, double value) {
    rows.push_back(row);
    columns.push_back(column);
    values.push_back(value);
  }
  StaticLdl ldl() const { return {n, n_rows, static_cast<int>(values.size()), rows.data(), columns.data()}; }
  Matrix dense() const {
    Matrix K = Matrix::Zero(n, n);
    for (std::size_t e = 0; e < values.size(); ++e) {
      K(rows[e] - 1, columns[e] - 1) += values[e];
      if (rows[e] != columns[e]) K(columns[e] - 1, rows[e] - 1) += values[e];
    }
    return K;
  }
};

/// A system that Ipopt made in `ricochet control NAME` with two or three intervals: n, n_rows and the number of entries,
/// then a line for each.
Entries recorded(const std::string& name) {
  std::ifstream file(test_data("kkt/" + name + ".txt"));
  Entries result;
  int n_entries = 0, row = 0, column = 0;
  double value = 0;
  file >> result.n >> result.n_rows >> n_entries;
  while (file >> row >> column >> value) result.add(row, column, value);
  EXPECT_EQ(static_cast<int>(result.values.size()), n_entries) << name;
  return result;
}

/// (W J'; J -C) with a positive definite W of a few entries per row, and C = c I.
Entries random_system(int n_primal, int n_rows, double c, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> unknown(1, n_primal);
  Entries result{.n = n_primal + n_rows, .n_rows = n_rows};
  for (int i = 1; i <= n_primal; ++i) result.add(i, i, 4 + std::abs(normal(random)));
  for (int i = 2; i <= n_primal; ++i) result.add(i, i - 1, normal(random));
  for (int i = 1; i <= n_rows; ++i) {
    result.add(n_primal + i, i, 1 + std::abs(normal(random)));  // independent rows
    for (int k = 0; k < 3; ++k) result.add(n_primal + i, unknown(random), 0.2 * normal(random));
    result.add(n_primal + i, n_primal + i, -c);
  }
  return result;
}

/// Of the matrix scaled to a unit diagonal or unit rows, which has the signs of the given one.
int negative_eigenvalues(Matrix K) {
  for (int sweep = 0; sweep < 20; ++sweep) {
    const Vector scale = K.cwiseAbs().rowwise().maxCoeff().cwiseSqrt().cwiseInverse();
    K = scale.asDiagonal() * K * scale.asDiagonal();
  }
  const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(K, Eigen::EigenvaluesOnly).eigenvalues();
  EXPECT_GT(eigenvalues.cwiseAbs().minCoeff(), 1e-13) << "the count would be rounding";
  return static_cast<int>((eigenvalues.array() < 0).count());
}

void expect_solves(StaticLdl& ldl, const Entries& system, unsigned seed) {
  const Matrix K = system.dense();
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Vector x = Vector::NullaryExpr(system.n, [&] { return normal(random); }), b = K * x;
  Vector found = b;
  EXPECT_LE(ldl.solve(found.data()), 1e-10);
  EXPECT_LE((b - K * found).lpNorm<Eigen::Infinity>(),
            1e-10 * (b.lpNorm<Eigen::Infinity>() + found.lpNorm<Eigen::Infinity>()));
}

class RecordedSystem : public testing::TestWithParam<const char*> {};

TEST_P(RecordedSystem, IsSolvedAndHasTheInertiaOfItsEigenvalues) {
  const Entries system = recorded(GetParam());
  StaticLdl ldl = system.ldl();
  ASSERT_TRUE(ldl.factorise(system.values.data()));
  EXPECT_EQ(ldl.n_negative(), negative_eigenvalues(system.dense()));
  for (unsigned seed = 1; seed <= 5; ++seed) expect_solves(ldl, system, seed);
}

INSTANTIATE_TEST_SUITE_P(StaticLdl, RecordedSystem,
                         testing::Values("two_carts", "push_box_goal", "cart_pole_friction", "hopper", "discs",
                                         "three_boxes"),
                         [](const auto& test) { return std::string(test.param); });

TEST(StaticLdl, SolvesRandomSystems) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const double c : {0.0, 1e-8, 1.0}) {
      const Entries system = random_system(40, 15, c, seed);
      StaticLdl ldl = system.ldl();
      ASSERT_TRUE(ldl.factorise(system.values.data())) << seed;
      EXPECT_EQ(ldl.n_negative(), 15) << "rows of full rank and W positive definite";
      expect_solves(ldl, system, seed);
    }
  }
}

/// The order of the first matrix serves others, of any inertia.
TEST(StaticLdl, FactorisesOtherMatricesInTheSameOrder) {
  Entries system = random_system(40, 15, 0, 1);
  StaticLdl ldl = system.ldl();
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 50; ++k) {
    ASSERT_TRUE(ldl.factorise(system.values.data()));
    EXPECT_EQ(ldl.n_negative(), negative_eigenvalues(system.dense())) << k;
    expect_solves(ldl, system, k);
    for (std::size_t e = 0; e < system.values.size(); ++e)
      if (system.rows[e] != system.columns[e] || system.rows[e] <= 40) system.values[e] += 0.5 * normal(random);
  }
}

TEST(StaticLdl, NeedsNoDiagonal) {
  Entries saddle{.n = 4, .n_rows = 2};  // W = 0
  saddle.add(3, 1, 2);
  saddle.add(4, 1, 1);
  saddle.add(4, 2, 3);
  StaticLdl ldl = saddle.ldl();
  ASSERT_TRUE(ldl.factorise(saddle.values.data()));
  EXPECT_EQ(ldl.n_negative(), 2);
  expect_solves(ldl, saddle, 1);
  Vector zero = Vector::Zero(4);
  EXPECT_EQ(ldl.solve(zero.data()), 0);
  EXPECT_TRUE(zero.isZero(0));
}

/// The least squares of a stationarity test: a residual per row, a chain of multipliers with bounds, and free ones, which
/// have no curvature of their own.
Entries least_squares(int n) {
  Entries system{.n = 4 * n, .n_rows = n};
  for (int k = 0; k < n; ++k) {
    const int residual = 1 + k, bounded = 1 + n + k, free = 1 + 2 * n + k, row = 1 + 3 * n + k;
    system.add(residual, residual, 1);
    system.add(bounded, bounded, 1e-3);
    system.add(row, residual, -1);
    system.add(row, bounded, 1 + 0.1 * (k % 7));
    if (k > 0) system.add(row, bounded - 1, -1);
    system.add(row, free, 0.5);
  }
  return system;
}

TEST(StaticLdl, FillsLittleWhereUnknownsHaveNoCurvature) {
  for (const int n : {10, 1000}) {
    const Entries system = least_squares(n);
    StaticLdl ldl = system.ldl();
    ASSERT_TRUE(ldl.factorise(system.values.data()));
    EXPECT_EQ(ldl.n_negative(), n);
    EXPECT_LE(ldl.n_factor_entries(), 20 * n) << "about n^2 / 2 with the free unknowns at the end of the order";
    if (n == 10) expect_solves(ldl, system, 1);
  }
}

TEST(StaticLdl, ReportsSingularMatrices) {
  Entries twice{.n = 4, .n_rows = 2};  // the same row two times
  for (const int i : {1, 2}) twice.add(i, i, 1);
  for (const int row : {3, 4}) {
    twice.add(row, 1, 1);
    twice.add(row, 2, 2);
  }
  StaticLdl ldl = twice.ldl();
  EXPECT_FALSE(ldl.factorise(twice.values.data()));
  twice.add(4, 4, -1e-6);
  StaticLdl regular = twice.ldl();
  EXPECT_TRUE(regular.factorise(twice.values.data()));
  EXPECT_EQ(regular.n_negative(), 2);

  Entries empty_row{.n = 3, .n_rows = 1};
  for (const int i : {1, 2}) empty_row.add(i, i, 1);
  StaticLdl without = empty_row.ldl();
  EXPECT_FALSE(without.factorise(empty_row.values.data()));
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    Entries bad = random_system(5, 2, 0, 1);
    bad.values[3] = value;
    EXPECT_FALSE(bad.ldl().factorise(bad.values.data()));
  }
}

/// min sum (x_i - i)^2 subject to a chain of rows, and bounds.
Nlp chain(int n) {
  Nlp nlp;
  for (int i = 0; i < n; ++i) {
    const int x = nlp.add_variable(0, 3, 1, "x");
    add_terms(nlp, -1, 0, {{x, -2.0 * i / n, 1}});
  }
  for (int i = 0; i + 1 < n; ++i) {
    add_terms(nlp, nlp.add_row(i % 2 ? 0.1 : -kInfinity, i % 2 ? 0.1 : 0.2, "row"), 0, {{i, -1}, {i + 1, 1, 0.1}});
  }
  return nlp;
}

TEST(IpoptLdl, SolvesWhatMumpsSolves) {
  const Nlp nlp = chain(30);
  const NlpResult mumps = IpoptSolver(nlp).solve(), ldl = IpoptSolver(nlp).solve({.linear_solver = LinearSolver::ldl});
  ASSERT_EQ(mumps.status, NlpStatus::solved) << mumps.message;
  ASSERT_EQ(ldl.status, NlpStatus::solved) << ldl.message;
  EXPECT_NEAR(ldl.objective, mumps.objective, 1e-9);
  EXPECT_LT((ldl.point.x - mumps.point.x).norm(), 1e-7);
  EXPECT_EQ(ldl.iterations, mumps.iterations) << "the same Newton steps";
}

/// The functions that Ipopt calls are those of the process, their data those of the thread.
TEST(IpoptLdl, SolvesInSeveralThreads) {
  const Nlp one = chain(20), other = chain(31);
  const NlpResult expected[] = {IpoptSolver(one).solve({.linear_solver = LinearSolver::ldl}),
                                IpoptSolver(other).solve({.linear_solver = LinearSolver::ldl})};
  std::vector<std::thread> threads;
  std::vector<int> different(4, 0);
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      for (int round = 0; round < 10; ++round) {
        const NlpResult result = IpoptSolver(k % 2 ? other : one).solve({.linear_solver = LinearSolver::ldl});
        different[k] += result.point.x != expected[k % 2].point.x;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(different, std::vector<int>(4, 0));
}

TEST(IpoptLdl, FindsTheOptimumOfAControlProblem) {
  const auto solve = [](const std::string& solver) {
    const ControlOptions options =
        ControlOptions::parse("cart_pole_friction -N 4 --simulate --linear-solver " + solver);
    const auto problem = options.make_problem();
    const auto transcription = options.make_transcription(*problem);
    EXPECT_EQ(transcription->guess_from_simulation(), Status::success);
    return Homotopy(options.homotopy_options()).solve(transcription->mpcc());
  };
  const MpccSolution mumps = solve("mumps"), ldl = solve("ldl");
  ASSERT_TRUE(mumps.succeeded()) << mumps.message;
  ASSERT_TRUE(ldl.succeeded()) << ldl.message;
  EXPECT_NEAR(ldl.objective, mumps.objective, 1e-6 * (1 + std::abs(mumps.objective)));
  EXPECT_LE(ldl.violation.value, 1e-9);
  EXPECT_LE(ldl.complementarity, 1e-12);
}

TEST(IpoptLdl, IsAnOptionOfControl) {
  EXPECT_EQ(ControlOptions::parse("two_carts").homotopy_options().linear_solver, LinearSolver::mumps);
  EXPECT_EQ(ControlOptions::parse("two_carts --linear-solver ldl").homotopy_options().linear_solver, LinearSolver::ldl);
  try {
    ControlOptions::parse("two_carts --linear-solver ma57").homotopy_options();
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "--linear-solver = ma57: one of mumps, ldl is required");
  }
}

}  // namespace
}  // namespace ricochet
