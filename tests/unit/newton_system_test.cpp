#include "methods/elements/newton_system.h"

#include <gtest/gtest.h>

#include <random>

#include "methods/elements/element_solver.h"
#include "methods/elements/switch_solver.h"
#include "methods/linear_algebra/band_lu.h"
#include "methods/linear_algebra/small_lu.h"
#include "methods/registry.h"
#include "problems/assembly/assembled_problem.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

double random_number() {
  static std::mt19937 random(1);
  return 2.0 * random() / std::mt19937::max() - 1;
}

TEST(SmallLu, SolvesWhateverTheSizeLeavesOfABlock) {
  SmallLu lu;
  for (const int n : {1, 2, 3, 4, 5, 8, 11, 33}) {  // columns go four at a time
    Matrix A(n, n), b(n, 2);
    for (double& x : A.reshaped()) x = random_number();
    for (double& x : b.reshaped()) x = random_number();
    A.diagonal().setZero();  // rows have to be exchanged
    if (n == 1) A(0, 0) = 0.5;
    const Matrix x = b;
    b = A * x;
    lu.factorize(A);
    lu.solve_in_place(b.data(), 2);
    // Condition numbers of a few hundred.
    EXPECT_LE((b - x).cwiseAbs().maxCoeff(), 1e-11) << n;
    EXPECT_LE((lu.of(A) * A - Matrix::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-11) << n;
    EXPECT_GT(lu.smallest_pivot(), 1e-6) << n;
  }
}

TEST(SmallLu, SaysWhatIsSingular) {
  Matrix A(5, 5);
  for (double& x : A.reshaped()) x = random_number();
  A.col(3) = A.col(0) - 2 * A.col(1);
  SmallLu lu;
  lu.factorize(A);
  EXPECT_LE(lu.smallest_pivot(), 1e-14) << "to rounding";
  A.col(1).setZero();  // and before the last column, with columns behind it
  lu.factorize(A);
  EXPECT_EQ(lu.smallest_pivot(), 0);
  EXPECT_FALSE(lu.inverse().allFinite());
}

TEST(BandLu, SolvesLikeADenseFactorization) {
  for (const auto& [n, lower, upper] : {std::tuple(1, 0, 0), {5, 1, 2}, {40, 3, 1}, {60, 7, 7}, {9, 8, 8}}) {
    BandLu band;
    Matrix A = Matrix::Zero(n, n);
    band.set_zero(n, lower, upper);
    for (int j = 0; j < n; ++j) {
      for (int i = std::max(0, j - upper); i <= std::min(n - 1, j + lower); ++i)
        A(i, j) = band.entry(i, j) = i == j ? 0.01 : random_number();  // small: rows have to be exchanged
    }
    Vector x = Vector::NullaryExpr(n, [] { return random_number(); });
    const Vector b = A * x;
    band.factorize();
    Vector solved = b;
    band.solve(solved.data());
    // Rounding times the condition, the same bound as of a dense factorisation with pivoting.
    const double condition = A.norm() * A.inverse().norm();
    EXPECT_LT((solved - x).norm(), 1e-15 * n * condition * x.norm()) << n << " " << lower << " " << upper;
  }
}

TEST(BandLu, SaysThatAMatrixIsSingular) {
  BandLu band;
  band.set_zero(3, 1, 1);
  for (int i = 0; i < 3; ++i) {
    for (int j = std::max(0, i - 1); j <= std::min(2, i + 1); ++j) band.entry(i, j) = i == 1 ? 0 : 1;
  }
  band.factorize();
  EXPECT_EQ(band.smallest_pivot(), 0);
}

template <class T>
struct Floor : ContactScene<T, 1> {
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0]}; }
};
template <class T>
struct Flat : ContactScene<T, 4> {
  Vec<T, 1> gap(const Vec<T, 4>& q) const { return {q[3] - q[1]}; }
  std::array<std::array<Vec<T, 4>, 1>, 1> tangents(const Vec<T, 4>&) const { return {{{{{-1, 0, 1, 0}}}}}; }
};
template <class T>
struct Bent : ContactScene<T, 4> {
  T bend{0.1};
  Vec<T, 1> gap(const Vec<T, 4>& q) const { return {q[3] - q[1] - bend * (q[2] - q[0]) * (q[2] - q[0])}; }
  std::array<std::array<Vec<T, 4>, 1>, 1> tangents(const Vec<T, 4>&) const { return {{{{{-1, 0, 1, 0}}}}}; }
};

/// n blocks in one or several columns, which stick or slide on each other; and the same, as if all were coupled.
struct Columns final : AssembledProblem {
  Columns(int n, int height, bool is_curved, bool is_coupled) : AssembledProblem({"columns", "", "", ""}, 1.0) {
    const auto floor = add_kind<Floor>({});
    const auto flat = add_kind<Flat>({{0.1, 0, 0.5}});
    const auto bent = add_kind<Bent>({{0.1, 0, 0.5}});
    for (int i = 0; i < n; ++i) {
      const double m = 1 + 0.1 * i;
      add_coordinate(m, 0.1, 0, 0);
      add_coordinate(m, -9.81 * m, 0, 0);
    }
    for (int i = 0; i < n; ++i) {
      const int x = 2 * i, y = x + 1;
      if (i % height == 0)
        add_contact(floor, {y}, "floor");
      else
        add_contact(is_curved ? bent : flat, {x - 2, y - 2, x, y}, "above");
    }
    for (int k = 0; is_coupled && k < info_.n_q; ++k) {
      for (int l = k + 1; l < info_.n_q; ++l) info_.structure.couplings.emplace_back(k, l);
    }
  }
};

struct IslandsCase {
  const char* name;
  int height;
  bool is_curved;
};

class NewtonIslands : public testing::TestWithParam<IslandsCase> {};

/// One dense system, and islands that are small or banded: steps of given length and steps to a switch.
TEST_P(NewtonIslands, SolveLikeOneDenseSystem) {
  constexpr int n = 24;
  const auto [name, height, is_curved] = GetParam();
  Vector v0 = Vector::NullaryExpr(2 * n, [] { return 0.1 * random_number(); });
  for (int i = 0; i < n; ++i) v0[2 * i + 1] = 0;
  v0[2 * n - 1] = 1;  // the topmost flies up and falls back
  std::vector<Element> runs[2];
  for (const bool is_coupled : {false, true}) {
    const Columns problem(n, height, is_curved, is_coupled);
    Counters counters;
    ElementSystem elements(problem, make_tableau("radau-iia", 2), counters);
    auto& run = runs[is_coupled];
    run.resize(2);
    for (Element& stages : run) {
      stages.resize(problem.info(), 2);
      stages.q0 = problem.info().q0;
      stages.v0 = v0;
      for (int i = 0; i + 1 < n; ++i) {
        const int n_t = problem.info().contacts[i].n_t;
        stages.modes[i] = n_t == 0 ? ContactMode::closed : i % 3 ? ContactMode::stick : ContactMode::slip_positive;
        if (stages.modes[i] == ContactMode::stick) {
          stages.v0[2 * i] = stages.v0[2 * i - 2];
        }
      }
      stages.h = 0.05;
    }
    ASSERT_EQ(ElementSolver(elements, 1e-14).solve(run[0]), ElementSolver::Result::converged) << name;
    ASSERT_EQ(
        SwitchSolver(elements, 1e-14).solve(std::span(run).subspan(1), {.contact = n - 1, .zeros_at_start = 1}, 10.0),
        SwitchSolver::Result::converged)
        << name;
  }
  // Forces of 24 bodies have a condition of some 1e3, and Newton's method ends at 1e-14.
  for (int k = 0; k < 2; ++k) {
    const Element &sparse = runs[0][k], &dense = runs[1][k];
    EXPECT_NEAR(sparse.h, dense.h, 1e-11 * dense.h);
    EXPECT_LT((sparse.q1 - dense.q1).norm(), 1e-11 * dense.q1.norm()) << name;
    EXPECT_LT((sparse.v1 - dense.v1).norm(), 1e-11 * dense.v1.norm()) << name;
    EXPECT_LT((sparse.lambda_n - dense.lambda_n).norm(), 1e-11 * dense.lambda_n.norm()) << name;
    EXPECT_LT((sparse.lambda_t - dense.lambda_t).norm(), 1e-11 * (1 + dense.lambda_t.norm())) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Columns, NewtonIslands,
                         testing::Values(IslandsCase{"one_column", 24, false}, IslandsCase{"of_three", 3, false},
                                         IslandsCase{"one_curved", 24, true}, IslandsCase{"curved_of_three", 3, true}),
                         [](const auto& test) { return test.param.name; });

/// Beads of equal mass exchange their velocities: after n (n - 1) / 2 + n impacts the row that came in as a whole goes
/// out as a whole, and the time of every impact follows from straight lines.
TEST(ManyContacts, AnElasticRowOfBeadsExchangesItsVelocities) {
  constexpr int n = 128;
  const auto row = make_problem("bead_row", {{"n", n}, {"e", 1}, {"g", 0}, {"duration", 0.5}});
  Settings settings;
  settings.steps = 100;
  const Solution s = make_method("fesd:radau-iia:2,elements=as_needed,max_elements=1000")->solve(*row, settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const double R = 0.05, spacing = 0.001, distance = 0.05;  // defaults of the scene
  // Points without extension, x_i - (2 i + 1) R, start at distance + i spacing with velocity -1. They pass through each
  // other and are mirrored by the wall; in order of their place they are the beads.
  std::vector<double> points;
  for (int i = 0; i < n; ++i) points.push_back(std::abs(distance + i * spacing - row->info().end_time));
  std::sort(points.begin(), points.end());
  for (int i = 0; i < n; ++i)
    EXPECT_NEAR(s.q[i] - (2 * i + 1) * R, points[i], 1e-11) << "bead " << i;  // 8256 impacts, each 1e-15 of 13 m
  EXPECT_EQ(s.events.size(), n * (n + 1) / 2);
}

}  // namespace
}  // namespace ricochet
