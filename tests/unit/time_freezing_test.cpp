#include <gtest/gtest.h>

#include <algorithm>

#include "methods/registry.h"
#include "methods/time_freezing/pseudo_time_solver.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve_frozen(const Problem& problem, const std::string& method, int steps) {
  Settings settings;
  settings.steps = steps;
  return make_method(method)->solve(problem, settings);
}

/// The spring and the damper return e of the velocity for any mass: the formula of the source is for M = 1.
TEST(TimeFreezing, HasItsRestitutionForAnyMass) {
  for (const double m : {0.01, 1.0, 100.0}) {
    for (const double e : {0.2, 0.5, 0.9}) {
      const auto ball = make_problem("bouncing_ball", {{"m", m}, {"e", e}});
      const Solution s = solve_frozen(*ball, "time_freezing:gauss:4", 200);
      ASSERT_TRUE(s.succeeded()) << s.message;
      ASSERT_FALSE(s.events.empty());
      const Event& bounce = s.events.front();
      // 20 elements of order 8 in the half period: (pi / 20)^8, and a constant.
      EXPECT_NEAR(bounce.v_plus[0] / -bounce.v_minus[0], e, 1e-8) << m;
      EXPECT_NEAR(bounce.Lambda_n[0] / (m * (bounce.v_plus[0] - bounce.v_minus[0])), 1, 1e-12) << "rounding";
    }
  }
}

/// What a push does is linear in the plane: exact, whatever its size and the length of a step.
TEST(TimeFreezing, StopsExactly) {
  const auto ball = make_problem("bouncing_ball", {{"e", 0}});
  for (const char* method : {"time_freezing:radau-iia:2,a_n=1", "time_freezing:radau-iia:2,a_n=10000"}) {
    const Solution s = solve_frozen(*ball, method, 7);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(ball->gap(s.q)[0], 0, 1e-14) << "rounding of q";
    EXPECT_NEAR(s.v[0], 0, 1e-14) << "rounding of the velocity before";
    ASSERT_FALSE(s.events.empty());
    EXPECT_NEAR(s.events[0].Lambda_n[0], -s.events[0].v_minus[0], 1e-12) << "m = 1 kg";
  }
}

/// A body that lies: lambda_n = push beta / s with s = 1 - beta is its weight, and the clock goes on by dt.
TEST(TimeFreezing, PersistentContactHasItsForce) {
  const auto ball = make_problem("bouncing_ball", {{"e", 0}, {"m", 3}});
  const ButcherTableau tableau = make_tableau("radau-iia", 3);
  const AuxiliaryDynamics auxiliary(*ball, 50, 0.1);
  Counters counters;
  PseudoTimeSolver solver(*ball, tableau, auxiliary, 1e-14, counters);
  Regions regions;
  regions.of.resize(1);
  regions.of[0].region = Region::sliding;
  solver.set_regions(regions);
  PseudoTimeElement element;
  element.resize(ball->info(), 3);
  element.q0 = Vector::Constant(1, 0.1);
  element.v0.setZero();
  element.guess(0.5, 0.5, Vector::Zero(1), Vector::Constant(1, 0.5), Vector());
  ASSERT_TRUE(solver.solve_to_clock(element, 0.25));
  for (int j = 0; j < 3; ++j) {
    EXPECT_NEAR(element.s[j], 1 - element.beta(0, j), 1e-14);
    EXPECT_NEAR(auxiliary.push[0] * element.beta(0, j) / element.s[j], 3 * 9.81, 1e-11) << "rounding of a division";
  }
  EXPECT_NEAR(element.h * element.s[0], 0.25, 1e-14);
  EXPECT_NEAR(element.v1[0], 0, 1e-14);
}

/// Friction while time is frozen is that of Routh: where slip reverses in an impact it acts both ways, and no energy comes
/// from it. Newton's law at one instant takes the impulse of the slip after the impact, and gains energy.
TEST(TimeFreezing, GainsNoEnergyAtKanesPendulum) {
  const auto pendulum = make_problem("kane_pendulum", {{"mu", 0.5}});
  const auto gain = [&](const std::string& method) {
    const Solution s = solve_frozen(*pendulum, method, 100);
    EXPECT_TRUE(s.succeeded()) << s.message;
    const auto impact = std::ranges::find(s.events, EventKind::impact, &Event::kind);
    EXPECT_NE(impact, s.events.end());
    return pendulum->kinetic_energy(impact->q, impact->v_plus) - pendulum->kinetic_energy(impact->q, impact->v_minus);
  };
  EXPECT_GT(gain("fesd:radau-iia:3"), 0.01);
  EXPECT_LT(gain("time_freezing:radau-iia:3"), 0);
}

TEST(TimeFreezing, SaysWhatItCannotRun) {
  const auto ball = make_problem("bouncing_ball");
  const Support support = make_method("time_freezing:lobatto-iiia:3")->can_run(ball->info());
  EXPECT_FALSE(support.ok);
  EXPECT_NE(support.reason.find("singular"), std::string::npos) << support.reason;
}

}  // namespace
}  // namespace ricochet
