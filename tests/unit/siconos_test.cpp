// The peer, where it is built: the same scheme in Siconos and in this suite.
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/contact_problems.h"

namespace ricochet {
namespace {

bool is_built(const std::string& name) {
  for (const auto& entry : methods()) {
    if (entry.name == name) return entry.make != nullptr;
  }
  ADD_FAILURE() << name << " is not even registered";
  return false;
}

Solution solve(const std::string& method, const std::string& problem, int steps, double tolerance) {
  Settings settings;
  settings.steps = steps;
  settings.tolerance = tolerance;
  return make_method(method)->solve(*make_problem(problem), settings);
}

TEST(Siconos, WithoutItsLibrarySaysWhatIsMissing) {
  if (is_built("siconos_moreau_jean")) GTEST_SKIP() << "it is built";
  for (const std::string method : {"siconos_moreau_jean", "siconos_d1_minus", "siconos_event_driven"}) {
    try {
      make_method(method);
      FAIL() << method;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), "method " + method + " is not built: libsiconos-kernel-dev not found");
    }
  }
}

TEST(Siconos, MoreauJeanTakesTheSameStepsAsOurs) {
  if (!is_built("siconos_moreau_jean")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // Constant matrices, without and with friction in the plane: there both schemes are the same equations.
  for (const std::string problem : {"two_balls_spring", "ball_row", "bead_row", "oblique_impact", "sliding_block"}) {
    const Solution ours = solve("moreau_jean", problem, 2000, 0);
    const Solution theirs = solve("siconos_moreau_jean", problem, 2000, 0);
    ASSERT_TRUE(theirs.succeeded()) << theirs.message;
    // Rounding in 2000 steps: at most 7e-12 seen.
    EXPECT_LE((ours.q - theirs.q).lpNorm<Eigen::Infinity>(), 1e-10) << problem;
    EXPECT_LE((ours.v - theirs.v).lpNorm<Eigen::Infinity>(), 1e-10) << problem;
    ASSERT_EQ(ours.events.size(), theirs.events.size()) << problem;
    for (std::size_t k = 0; k < ours.events.size(); ++k) {
      EXPECT_EQ(ours.events[k].contact, theirs.events[k].contact) << problem;
      EXPECT_EQ(ours.events[k].t, theirs.events[k].t) << problem;
    }
  }
}

TEST(Siconos, D1MinusTakesTheSameStepsAsOursWhereTheSchemesCoincide) {
  if (!is_built("siconos_d1_minus")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // Beads that strike a wall and each other with one impact at a time: no contact stays closed for a step.
  const Solution ours = solve("d1_minus", "bead_row", 1000, 0), theirs = solve("siconos_d1_minus", "bead_row", 1000, 0);
  ASSERT_TRUE(theirs.succeeded()) << theirs.message;
  // Rounding in 1000 steps.
  EXPECT_LE((ours.q - theirs.q).lpNorm<Eigen::Infinity>(), 1e-10);
  EXPECT_LE((ours.v - theirs.v).lpNorm<Eigen::Infinity>(), 1e-10);
}

TEST(Siconos, EventDrivenFindsTheImpactsOfABall) {
  if (!is_built("siconos_event_driven")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  const Solution s = solve("siconos_event_driven", "bouncing_ball", 0, 1e-10);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.events.size(), 3u);
  EXPECT_NEAR(s.events[0].t, std::sqrt(2 * 0.9 / 9.81), 1e-9);
  // tests/data/ground_truth.json, P1a_ball_e09; impacts are located to 10 tolerances
  EXPECT_NEAR(s.q[0], 0.370977516354263779, 1e-8);
}

/// Where the solution is unique: a regular matrix, and little friction, so that Coulomb's law has one solution.
TEST(Siconos, SolvesContactProblemsAsOursDo) {
  if (!has_siconos_contact_solver()) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  for (const auto& [n_c, n_t, n_q] : {std::array{6, 0, 12}, {4, 1, 16}, {8, 1, 40}, {4, 2, 20}, {8, 2, 60}}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      ContactProblem problem = random_problem(FrictionLaw::coulomb, n_c, n_t, n_q, seed);
      for (auto& contact : problem.contacts) contact.mu *= 0.3;
      const auto theirs_from = make_siconos_contact_solver(1e-10, 100000);
      const Answer theirs = solve(*theirs_from, problem);
      ASSERT_EQ(theirs.status, ContactStatus::solved)
          << n_c << " " << n_t << " seed " << seed << " " << theirs.violation;
      for (const auto kind : {ContactSolverKind::pgs, ContactSolverKind::newton, ContactSolverKind::interior_point}) {
        const Answer ours =
            solve(*make_contact_solver({.kind = kind, .facets = 0, .tolerance = 1e-11, .iterations = 100000}), problem);
        ASSERT_EQ(ours.status, ContactStatus::solved) << n_c << " " << n_t << " seed " << seed << " " << ours.violation;
        // 1e-10 of the natural map times the condition of G, up to 1e4 for these seeds
        EXPECT_LE((ours.w - theirs.w).norm(), 1e-6) << n_c << " " << n_t << " seed " << seed;
        EXPECT_LE((ours.r - theirs.r).norm(), 1e-6 * (1 + theirs.r.norm())) << n_c << " " << n_t << " seed " << seed;
      }
    }
  }
}

TEST(Siconos, IsAContactSolverOfTimeStepping) {
  if (!has_siconos_contact_solver()) {
    EXPECT_THROW(make_method("moreau_jean,solver=siconos"), InputError);
    return;
  }
  for (const std::string problem : {"ball_row", "stacked_blocks", "ball_3d"}) {
    const Solution ours = solve("moreau_jean,solver=newton", problem, 400, 0);
    const Solution theirs = solve("moreau_jean,solver=siconos", problem, 400, 0);
    ASSERT_TRUE(theirs.succeeded()) << problem << ": " << theirs.message;
    // 1e-9 of the velocities in each of 400 steps
    EXPECT_LE((ours.v - theirs.v).lpNorm<Eigen::Infinity>(), 1e-6) << problem;
  }
  EXPECT_THROW(solve("anitescu_convex,solver=siconos", "stacked_blocks", 10, 0), InputError) << "the associated law";
}

TEST(Siconos, DeclinesWhatItCannotDo) {
  if (!is_built("siconos_event_driven")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  const auto info = make_problem("sliding_block")->info();
  EXPECT_FALSE(make_method("siconos_event_driven")->can_run(info).ok);
  EXPECT_TRUE(make_method("siconos_moreau_jean")->can_run(info).ok);
  EXPECT_THROW(make_method("siconos_moreau_jean,theta=0.2"), InputError);
}

}  // namespace
}  // namespace ricochet
