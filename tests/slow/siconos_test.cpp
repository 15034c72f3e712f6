// The peer, where it is built: the same scheme in Siconos and in this suite.
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/contact_problems.h"
#include "tests/solve_with_samples.h"

namespace ricochet {
namespace {

bool has_peer(const std::string& name) {
  for (const auto& entry : methods()) {
    if (entry.name == name) return entry.make != nullptr;
  }
  ADD_FAILURE() << name << " is not even registered";
  return false;
}

/// Of all contacts at the ends of all steps [m].
double deepest_penetration(const Solution& s, const Problem& problem) {
  double deepest = 0;
  for (const auto& sample : s.samples) deepest = std::max(deepest, -problem.gap(sample.q).minCoeff());
  return deepest;
}

TEST(Siconos, IsBuiltOrSaysWhatIsMissing) {
  for (const std::string method : {"siconos_moreau_jean", "siconos_projection", "siconos_direct_projection",
                                   "siconos_schatzman_paoli", "siconos_d1_minus", "siconos_event_driven"}) {
    if (has_peer(method)) continue;
    try {
      make_method(method);
      FAIL() << method;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), "method " + method + " is not built: libsiconos-kernel-dev not found");
    }
  }
}

TEST(Siconos, MoreauJeanTakesTheSameStepsAsOurs) {
  if (!has_peer("siconos_moreau_jean")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // Constant matrices, without and with friction in the plane: there both schemes are the same equations.
  for (const std::string problem : {"two_balls_spring", "ball_row", "bead_row", "oblique_impact", "sliding_block"}) {
    const Solution ours = solve_with_samples(*make_problem(problem), "moreau_jean", 2000);
    const Solution theirs = solve_with_samples(*make_problem(problem), "siconos_moreau_jean", 2000);
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

TEST(Siconos, DirectProjectionTakesTheSameStepsAsOurs) {
  if (!has_peer("siconos_direct_projection")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // Affine gaps and an M that is a multiple of the identity: there both norms project to the same position.
  for (const std::string problem : {"bouncing_ball", "oblique_impact", "sliding_block", "bead_row"}) {
    const Solution ours = solve_with_samples(*make_problem(problem), "moreau_jean,projection=on", 2000);
    const Solution theirs = solve_with_samples(*make_problem(problem), "siconos_direct_projection", 2000);
    ASSERT_TRUE(theirs.succeeded()) << theirs.message;
    // Rounding in 2000 steps.
    EXPECT_LE((ours.q - theirs.q).lpNorm<Eigen::Infinity>(), 1e-10) << problem;
    EXPECT_LE((ours.v - theirs.v).lpNorm<Eigen::Infinity>(), 1e-10) << problem;
  }
}

TEST(Siconos, CombinedProjectionLeavesNoPenetration) {
  if (!has_peer("siconos_projection")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // One contact, affine and curved; two, of bodies that a spring couples; friction in space.
  for (const std::string id : {"bouncing_ball", "P8a_bead_leaves_circle", "two_balls_spring", "ball_3d"}) {
    const auto problem = make_problem(id);
    const Solution with = solve_with_samples(*problem, "siconos_projection", 400);
    const Solution without = solve_with_samples(*problem, "siconos_moreau_jean", 400);
    ASSERT_TRUE(with.succeeded()) << id << ": " << with.message;
    // It projects to 1e-10 of the lengths of these runs, at most 20 m.
    EXPECT_LE(deepest_penetration(with, *problem), 4e-9) << id;
    EXPECT_GE(deepest_penetration(without, *problem), 1e-5) << id;  // what there is to project: 6e-5 m to 8e-3 m
  }
}

TEST(Siconos, ProjectionHasOrderOneOnAClosedContactThatOpens) {
  for (const std::string method : {"siconos_projection", "siconos_direct_projection"}) {
    if (!has_peer(method)) GTEST_SKIP() << "libsiconos-kernel-dev not found";
    const auto error = [&](int steps) {
      const Solution fine = solve_with_samples(*make_problem("P8a_bead_leaves_circle"), "fesd:radau-iia:3", 40);
      const Solution s = solve_with_samples(*make_problem("P8a_bead_leaves_circle"), method, steps);
      EXPECT_TRUE(s.succeeded()) << s.message;
      return (s.q - fine.q).norm() + (s.v - fine.v).norm();
    };
    // A ratio of 4 where the step is a quarter; 3.9 to 4.2 seen.
    EXPECT_NEAR(error(1000) / error(4000), 4, 0.5) << method;
  }
}

TEST(Siconos, SchatzmanPaoliTakesTheSameStepsAsOurs) {
  if (!has_peer("siconos_schatzman_paoli")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // Beads that bounce off a wall and each other. Theirs starts with q_1 = q_0 + h v_0, ours with q_1 = q_0 + h v_0 -
  // h^2 g: the same where ours starts slower by h g.
  constexpr int kSteps = 1000;
  const double g = 9.81, h = 0.5 / kSteps;
  const auto slower = make_problem("bead_row", {{"e", 0.6}, {"speed", 1 - h * g}});
  const Solution ours = solve_with_samples(*slower, "schatzman_paoli", kSteps);
  for (const std::string theta : {"0", "0.5", "1"}) {  // no matter without springs and dampers
    const Solution theirs =
        solve_with_samples(*make_problem("bead_row", {{"e", 0.6}}), "siconos_schatzman_paoli,theta=" + theta, kSteps);
    ASSERT_TRUE(theirs.succeeded()) << theirs.message;
    EXPECT_LE((ours.q - theirs.q).lpNorm<Eigen::Infinity>(), 1e-10);  // rounding in 1000 steps
  }
}

TEST(Siconos, SchatzmanPaoliHasOrderOneOnTheBouncingBall) {
  if (!has_peer("siconos_schatzman_paoli")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  for (const int steps : {500, 1000, 2000, 4000, 8000, 16000}) {
    const Solution s = solve_with_samples(*make_problem("bouncing_ball"), "siconos_schatzman_paoli", steps);
    ASSERT_TRUE(s.succeeded()) << s.message;
    // reference/data/ground_truth.json, P1a_ball_e09. Each of three impacts comes up to a step early or late, and changes a
    // velocity by up to 8 m/s: 24 m/s h, and the start's g h / 2 over 2 s.
    EXPECT_NEAR(s.q[0], 0.370977516354263779, 34 * 2.0 / steps) << steps;
  }
  // Order 1 without impacts, to the last digit: the start lacks g h^2 / 2, which makes g h t / 2 of the position.
  const auto flight = make_problem("bouncing_ball", {{"duration", 0.4}});
  const double q_exact = 1 - 9.81 / 2 * 0.16;
  EXPECT_NEAR(solve_with_samples(*flight, "siconos_schatzman_paoli", 400).q[0] - q_exact, 9.81 * 1e-3 * 0.4 / 2, 1e-12);
}

TEST(Siconos, D1MinusTakesTheSameStepsAsOursWhereTheSchemesCoincide) {
  if (!has_peer("siconos_d1_minus")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  // Beads that strike a wall and each other with one impact at a time: no contact stays closed for a step.
  const Solution ours = solve_with_samples(*make_problem("bead_row"), "d1_minus", 1000),
                 theirs = solve_with_samples(*make_problem("bead_row"), "siconos_d1_minus", 1000);
  ASSERT_TRUE(theirs.succeeded()) << theirs.message;
  // Rounding in 1000 steps.
  EXPECT_LE((ours.q - theirs.q).lpNorm<Eigen::Infinity>(), 1e-10);
  EXPECT_LE((ours.v - theirs.v).lpNorm<Eigen::Infinity>(), 1e-10);
}

TEST(Siconos, EventDrivenFindsTheImpactsOfABall) {
  if (!has_peer("siconos_event_driven")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  Settings settings;
  settings.tolerance = 1e-10;
  const Solution s = make_method("siconos_event_driven")->solve(*make_problem("bouncing_ball"), settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.events.size(), 3u);
  EXPECT_NEAR(s.events[0].t, std::sqrt(2 * 0.9 / 9.81), 1e-9);
  // reference/data/ground_truth.json, P1a_ball_e09; impacts are located to 10 tolerances
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
      const SolverAnswer theirs = solve(*theirs_from, problem);
      ASSERT_EQ(theirs.status, ContactStatus::solved)
          << n_c << " " << n_t << " seed " << seed << " " << theirs.violation;
      for (const auto kind : {ContactSolverKind::pgs, ContactSolverKind::newton, ContactSolverKind::interior_point}) {
        const SolverAnswer ours =
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
    const Solution ours = solve_with_samples(*make_problem(problem), "moreau_jean,solver=newton", 400);
    const Solution theirs = solve_with_samples(*make_problem(problem), "moreau_jean,solver=siconos", 400);
    ASSERT_TRUE(theirs.succeeded()) << problem << ": " << theirs.message;
    // 1e-9 of the velocities in each of 400 steps
    EXPECT_LE((ours.v - theirs.v).lpNorm<Eigen::Infinity>(), 1e-6) << problem;
  }
  EXPECT_THROW(solve_with_samples(*make_problem("stacked_blocks"), "anitescu_convex,solver=siconos", 10), InputError)
      << "the associated law";
}

TEST(Siconos, RunsScenesWithoutContacts) {
  if (!has_peer("siconos_moreau_jean")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  const auto oscillator = read_scene_text(
      R"({"id": "oscillator", "q0": ["1"], "v0": ["0"], "T": 1, "M": [["1"]], "f": ["-q[0]"], "contacts": []})",
      "oscillator.json");
  for (const std::string method :
       {"siconos_moreau_jean", "siconos_projection", "siconos_direct_projection", "siconos_schatzman_paoli"}) {
    const Solution s = solve_with_samples(*oscillator, method, 1000);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    // Schatzman-Paoli lacks half a step of acceleration at its start, 5e-4, and damps; the others have 1e-7.
    EXPECT_NEAR(s.q[0], std::cos(1.0), method == "siconos_schatzman_paoli" ? 1e-3 : 1e-6) << method;
  }
}

TEST(Siconos, DeclinesWhatItCannotDo) {
  if (!has_peer("siconos_event_driven")) GTEST_SKIP() << "libsiconos-kernel-dev not found";
  const auto info = make_problem("sliding_block")->info();
  EXPECT_FALSE(make_method("siconos_event_driven")->can_run(info).ok);
  EXPECT_TRUE(make_method("siconos_moreau_jean")->can_run(info).ok);
  EXPECT_THROW(make_method("siconos_moreau_jean,theta=0.2"), InputError);

  EXPECT_FALSE(make_method("siconos_schatzman_paoli")->can_run(info).ok) << "friction";
  const auto curved = make_problem("P8a_bead_leaves_circle")->info();
  EXPECT_FALSE(make_method("siconos_schatzman_paoli")->can_run(curved).ok) << "a gap that is not affine";
  EXPECT_TRUE(make_method("siconos_projection")->can_run(curved).ok);
  const auto beads = [](int n) { return make_problem("bead_row", {{"n", n}})->info(); };
  EXPECT_TRUE(make_method("siconos_direct_projection")->can_run(beads(16)).ok);
  EXPECT_FALSE(make_method("siconos_direct_projection")->can_run(beads(17)).ok);
  EXPECT_TRUE(make_method("siconos_projection")->can_run(beads(198)).ok);
  EXPECT_FALSE(make_method("siconos_projection")->can_run(beads(199)).ok);
}

}  // namespace
}  // namespace ricochet
