// The parts of extrapolated steps: the table of Aitken and Neville, and the step of Moreau's midpoint rule.
#include <gtest/gtest.h>

#include <cmath>

#include "methods/time_stepping/common/moreau_extrapolation.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Rows j remove the powers h^1 .. h^(j-1) from the error, and nothing else.
TEST(ExtrapolationTable, RemovesPowersOfTheStep) {
  const auto result = [](double h) { return Vector::Constant(1, 7 + 3 * h - 2 * h * h + 5 * h * h * h); };
  ExtrapolationTable table(1);
  for (int j = 1; j <= 4; ++j) {
    table.next() = result(1.0 / j);
    table.extrapolate();
    EXPECT_EQ(table.rows(), j);
    if (j == 1) EXPECT_EQ(table.best()[0], 13);
    if (j == 3) EXPECT_NEAR(table.best()[0], 7 + 5.0 / 6, 1e-13) << "h^3 of the rows 1, 1/2, 1/3 leaves their product";
    if (j == 3) EXPECT_GT(std::abs(table.before()[0] - table.best()[0]), 0.1);
  }
  EXPECT_NEAR(table.best()[0], 7, 1e-12);
  table.clear();
  EXPECT_EQ(table.rows(), 0);
}

class MoreauMidpointOf : public testing::TestWithParam<const char*> {};

/// (1)-(4) of moreau_midpoint.h, from the dense views of the problem.
TEST_P(MoreauMidpointOf, FulfilsItsEquations) {
  const auto problem = make_problem(GetParam());
  const ProblemInfo& info = problem->info();
  Settings settings;
  settings.audit = true;
  Counters counters;
  MoreauMidpoint midpoint(*problem, settings, {}, nullptr, counters, 1e-9);
  MoreauState from(info), to(info);
  constexpr double kStep = 0.01;
  int pressed = 0;
  for (int k = 0; k < 200; ++k) {
    ASSERT_TRUE(midpoint.step(kStep, MoreauMidpoint::Rates::in_middle, from, to)) << midpoint.reason();
    const Vector q_m = from.q + 0.5 * kStep * from.v;
    Vector impulse = Vector::Zero(info.n_q);
    if (midpoint.has_contacts())
      impulse = problem->force_directions(problem->normal_jacobian(q_m)) * midpoint.Lambda_n() +
                problem->force_directions(problem->tangent_jacobian(q_m)) * midpoint.Lambda_t();
    const Matrix M = problem->mass_matrix(q_m);
    const Vector missing = M * (to.v - from.v) - kStep * problem->force(q_m, from.v) - impulse;  // (2)
    const double size = (M.cwiseAbs() * (from.v.cwiseAbs() + to.v.cwiseAbs())).maxCoeff() + 1e-3;
    EXPECT_LE(missing.cwiseAbs().maxCoeff(), 1e-12 * size) << k;
    EXPECT_LE((to.q - q_m - 0.5 * kStep * to.v).cwiseAbs().maxCoeff(), 1e-15 * (1 + q_m.cwiseAbs().maxCoeff()));  // (4)
    EXPECT_LE(midpoint.residual(), 1e-11);
    const Matrix J_n = problem->normal_jacobian(q_m);
    for (const int i : info.unilateral) {
      if (!midpoint.has_contacts() || !(midpoint.Lambda_n()[i] > 0)) continue;
      ++pressed;
      const double before = J_n.col(i).dot(from.v), after = J_n.col(i).dot(to.v);
      const bool bounced = midpoint.strikes(i);
      EXPECT_NEAR(after, bounced ? -info.contacts[i].eps_r * before : 0, 1e-10 * (1 + std::abs(before))) << k;  // (3)
    }
    from = to;
  }
  EXPECT_GT(pressed, 0) << "else (3) was not looked at";
}

INSTANTIATE_TEST_SUITE_P(Scenes, MoreauMidpointOf, testing::Values("bouncing_ball", "sliding_block", "rocking_block"),
                         [](const auto& test) { return test_name(test.param); });

}  // namespace
}  // namespace ricochet
