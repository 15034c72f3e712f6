// Time stepping of higher order: steps that can be checked by hand, and what each scheme promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/agreement.h"
#include "tests/solve_with_samples.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// A ball of radius 0.1 whose gap is 0.5 m; one step of 0.4 s would take it to -0.28.
TEST(Rattle, LandsOnTheSurfaceAndStopsInOneStep) {
  const auto p = make_problem("bouncing_ball", {{"e", 0}, {"height", 0.6}, {"duration", 0.4}});
  const Solution s = solve_with_samples(*p, "rattle", 1);
  EXPECT_NEAR(s.q[0], 0.1, 1e-15);
  EXPECT_NEAR(s.v[0], 0, 1e-15);
  // All impulses together: what gravity gave.
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_NEAR(s.events[0].Lambda_n[0], 9.81 * 0.4, 1e-14);
}

TEST(Rattle, BouncesWithTheVelocityBeforeTheStep) {
  const auto p = make_problem("bouncing_ball", {{"e", 0.8}, {"height", 0.6}, {"duration", 0.4}});
  const Solution s = solve_with_samples(*p, "rattle", 2);  // free flight to 0.4038 m, then the floor
  EXPECT_NEAR(s.samples[0].q[0], 0.6 - 9.81 * 0.2 * 0.2 / 2, 1e-15);
  EXPECT_NEAR(s.q[0], 0.1, 1e-15);
  EXPECT_NEAR(s.v[0], 0.8 * 9.81 * 0.2, 1e-14);
}

/// Neither a gap nor its rate drifts, of joints and of contacts that stay closed.
TEST(Rattle, KeepsGapsAndTheirRates) {
  for (const char* id : {"pendulum_wall_cartesian", "falling_rod", "slider_crank_stop"}) {
    const auto p = make_problem(id);
    const Solution s = solve_with_samples(*p, "rattle", 500);
    const bool joints_only = p->info().has_bilateral();
    for (const auto& sample : s.samples) {
      const Vector gap = p->gap(sample.q), rate = p->normal_jacobian(sample.q).transpose() * sample.v_plus;
      for (int i = 0; i < p->n_c(); ++i) {
        if (joints_only && !p->info().contacts[i].is_bilateral) continue;
        // rounding of Newton's corrections, relative to lengths of one metre; of rates by 1 / h = 1e3 of that
        EXPECT_NEAR(gap[i], 0, 1e-12) << id << " at t = " << sample.t;
        EXPECT_NEAR(rate[i], 0, 1e-10) << id << " at t = " << sample.t;
      }
    }
  }
}

/// Its steps are symmetric: with the velocity turned round it goes back to where it came from.
TEST(Rattle, GoesBackTheWayItCame) {
  const auto p = make_problem("pendulum_wall_cartesian", {{"duration", 0.2}});
  const Vector q0 = p->info().q0, v0 = p->info().v0;
  const Solution there = solve_with_samples(*p, "rattle", 40);
  ASSERT_TRUE(there.events.empty()) << "it has not met the wall yet";
  EXPECT_GT((there.q - q0).norm(), 0.01) << "it has moved";
  p->set_initial_state(there.q, -there.v);
  const Solution back = solve_with_samples(*p, "rattle", 40);
  // Newton's tolerance, 40 steps each way
  EXPECT_LT((back.q - q0).norm(), 1e-11);
  EXPECT_LT((back.v + v0).norm(), 1e-11);
}

/// Forces are constant while the block slides: exact for a trapezoidal rule.
TEST(D1Minus, SlidesExactly) {
  const auto p = make_problem("sliding_block", {{"duration", 0.1}});
  const double mu = p->info().contacts[0].mu, v0 = p->info().v0[0], g = 9.81;
  const Solution s = solve_with_samples(*p, "d1_minus", 2);
  EXPECT_NEAR(s.q[0], p->info().q0[0] + 0.1 * v0 - mu * g * 0.1 * 0.1 / 2, 1e-14);
  EXPECT_NEAR(s.v[0], v0 - mu * g * 0.1, 1e-14);
  EXPECT_NEAR(s.q[1], p->info().q0[1], 1e-15);
}

/// A contact that bounces has no force, and its impulse is Newton's.
TEST(D1Minus, BouncesAtTheEndOfTheStep) {
  const auto p = make_problem("bouncing_ball", {{"e", 0.8}, {"height", 0.2}, {"duration", 0.3}});
  const Solution s = solve_with_samples(*p, "d1_minus", 3);
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_NEAR(s.events[0].t, 0.2, 1e-15) << "the gap of 0.1 m is gone after 0.143 s";
  EXPECT_NEAR(s.events[0].v_plus[0], 0.8 * 9.81 * 0.1, 1e-14) << "e times the velocity at the beginning";
  EXPECT_NEAR(s.v[0], 0.8 * 9.81 * 0.1 - 9.81 * 0.1, 1e-14) << "then it flies";
}

/// Through impacts, smooth take-off, stick and slip, slip in space that turns, an accumulation of impacts.
TEST(ExtrapolatedMoreau, HasAnErrorInProportionToItsTolerance) {
  for (const char* id : {"P1b_ball_e05_pre_zeno", "P1d_ball_e05_through_zeno", "P4a_clock_driven_block",
                         "P5_slip_reversal", "P6a_oblique_slip", "P7a_slide3d_to_stick", "P8a_bead_leaves_circle"}) {
    const auto p = ground_truth_problem(id);
    const auto truth = reference::read_ground_truth(reference_data("ground_truth.json"), id);
    for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
      Settings settings;
      settings.tolerance = tolerance;
      const Solution s = make_method("extrapolated_moreau")->solve(*p, settings);
      ASSERT_TRUE(s.succeeded()) << id << ": " << s.message;
      // The position of an impact is wrong by the shortest step, tolerance T, and later impacts multiply that; the worst
      // seen is 50 (P1b, 1e-4).
      EXPECT_LT(reference::final_state_difference(s.q, s.v, truth.q, truth.v), 200 * tolerance) << id;
      EXPECT_LT(s.counters.steps, 400) << id << ": few steps besides those at switches";
    }
  }
}

/// Free flight has no error, so that steps grow: two balls that meet within one are open at both of its ends.
TEST(ExtrapolatedMoreau, SeesBodiesThatPassThroughEachOtherWithinAStep) {
  const auto p = read_scene_file(test_data("../../bench/experiments/scenes/two_equal_balls.json"));
  Settings settings;
  settings.tolerance = 1e-9;
  const Solution s = make_method("extrapolated_moreau")->solve(*p, settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_NEAR(s.q[0], 0.52 - 0.2, 1e-7) << "some of the shortest steps of 1e-9 s";
  EXPECT_NEAR(s.q[1], 0.2 + 1, 1e-7);
  const Solution captured = solve_with_samples(*p, "event_capturing,order=3", 4);
  ASSERT_TRUE(captured.succeeded()) << captured.message;
  EXPECT_NEAR(captured.q[0], 0.32, 2.0 / (4 * 4 * 4)) << "its shortest steps";
  EXPECT_NEAR(captured.v[0], 0, 1e-12);
}

/// Whatever it divides its steps into, samples are those of the grid.
TEST(EventCapturing, KeepsItsGrid) {
  const auto p = make_problem("bouncing_ball", {{"e", 0.8}, {"height", 0.6}, {"duration", 1.5}});
  const Solution s = solve_with_samples(*p, "event_capturing,order=3", 30);
  ASSERT_EQ(s.samples.size(), 30u);
  for (int k = 0; k < 30; ++k) EXPECT_NEAR(s.samples[k].t, 0.05 * (k + 1), 1e-14);
  // The first impact, at sqrt(2 0.5 / 9.81), to a few of the shortest steps, T / N^3 = 5.6e-5 s.
  ASSERT_FALSE(s.events.empty());
  EXPECT_NEAR(s.events[0].t, std::sqrt(1 / 9.81), 3 * 5.6e-5);
}

}  // namespace
}  // namespace ricochet
