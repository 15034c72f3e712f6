// Impacts that begin and end within a step: error control has to see them, however long the steps are.
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "reference/event_located.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

struct Graze {
  std::shared_ptr<const Problem> problem;
  double t = 0, speed = 0;  ///< of the impact [s], [m/s]
};

/// A disc without friction thrown up so that it would rise `depth` above the roof.
Graze graze(double depth) {
  constexpr double g = 9.81, H = 0.8, R = 0.1, y0 = 0.4;
  const double v = std::sqrt(2 * g * (H - R - y0 + depth)), speed = std::sqrt(2 * g * depth);
  return {make_problem("ball_in_box", {{"mu", 0},
                                       {"omega0", 0},
                                       {"x0", 0.5},
                                       {"v_x0", 0},
                                       {"y0", y0},
                                       {"v_y0", v},
                                       {"g", g},
                                       {"H", H},
                                       {"R", R},
                                       {"duration", 0.4}}),
          (v - speed) / g, speed};
}

class GrazingImpact : public testing::TestWithParam<double> {};

void expect_impact(const Solution& s, const Graze& graze, double tolerance) {
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.events.size(), 1U);
  EXPECT_EQ(s.events[0].kind, EventKind::impact);
  // The gap closes at `speed`: an error of the position is one of the time, and the speed changes by g t.
  EXPECT_NEAR(s.events[0].t, graze.t, tolerance / graze.speed);
  EXPECT_NEAR(s.events[0].v_minus[1], graze.speed, 9.81 * tolerance / graze.speed);
}

TEST_P(GrazingImpact, IsNotPassedByTheReference) {
  const Graze graze = ricochet::graze(GetParam());
  for (const auto integrator : {reference::adams, reference::bdf}) {
    // 100 tolerances: local errors of the steps before add up.
    expect_impact(reference::integrate_event_located(*graze.problem, {.integrator = integrator, .tolerance = 1e-11}),
                  graze, 1e-9);
  }
}

TEST_P(GrazingImpact, IsNotPassedByErrorControl) {
  const Graze graze = ricochet::graze(GetParam());
  for (const char* method : {"fesd_adaptive:radau-iia:3", "fesd_adaptive:gauss:4"}) {
    Settings settings;
    settings.tolerance = 1e-9;
    settings.audit = true;
    const Solution s = make_method(method)->solve(*graze.problem, settings);
    expect_impact(s, graze, 1e-13);  // free flight is exact up to rounding
    EXPECT_LE(s.max_residual(), 1e-12) << method;
  }
}

INSTANTIATE_TEST_SUITE_P(Depths, GrazingImpact, testing::Values(1e-2, 1e-4, 1e-6, 1e-8));

TEST(GrazingImpact, AtSpeedZeroIsNone) {
  const Graze graze = ricochet::graze(0);
  Settings settings;
  settings.tolerance = 1e-9;
  for (const char* method : {"cvode:adams", "cvode:bdf", "fesd_adaptive:radau-iia:4"}) {
    const Solution s = make_method(method)->solve(*graze.problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << s.message;
    // Free fall, or an impact at what integration errors of 1e-8 m are worth: sqrt(2 g 1e-8) = 4.4e-4 m/s.
    EXPECT_NEAR(s.v[1], graze.problem->info().v0[1] - 9.81 * 0.4, 2 * 4.4e-4) << method;
  }
}

}  // namespace
}  // namespace ricochet
