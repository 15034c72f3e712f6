// The arbiter of tests/tools against closed forms, against sums that a loop adds up, and against another program.
#include "tests/tools/event_arbiter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/test_data.h"

namespace ricochet {
namespace {

using arbiter::BigFloat;
using arbiter::EventArbiter;

EventArbiter::Result solve(const std::string& scene) {
  return EventArbiter(*read_scene_text(scene, "scene")).solve();
}

/// Numbers with hundred digits, rounded to double, against closed forms in double: a few roundings.
constexpr double kRounding = 2e-15;

TEST(BigFloat, HoldsNumbersThatNoMachineWordHolds) {
  BigFloat x = BigFloat(1) / BigFloat(3);
  for (int k = 0; k < 200; ++k) x *= x;  // 3^(-2^200)
  BigFloat y = x;
  for (int k = 0; k < 200; ++k) y = sqrt(y);
  EXPECT_EQ((x + BigFloat(1) - BigFloat(1)).to_double(), 0);
  EXPECT_GT(x, BigFloat(0));
  EXPECT_EQ((BigFloat(3) * y).to_double(), 1);  // 200 roots halve the error of x, which 200 squares had doubled
}

TEST(EventArbiter, LetsABallBounceAndComeToRest) {
  const double g = 9.81, h = 0.5, e = 0.5;
  const auto scene = [](const char* end) {
    return fmt::format(R"({{"q0": ["0.5"], "v0": ["0"], "T": "{}", "M": [["2"]], "f": ["-2*9.81"],
                           "contacts": [{{"name": "ground", "gap": "q[0]", "e": "0.5"}}]}})",
                       end);
  };
  const double t_0 = std::sqrt(2 * h / g), v_0 = g * t_0;
  // The end lies between the first impact, at 0.319 s, and the second, at 0.639 s.
  const auto flying = solve(scene("0.6"));
  const double s = 0.6 - t_0, v = e * v_0;
  EXPECT_NEAR(flying.q[0], v * s - g * s * s / 2, kRounding);
  EXPECT_NEAR(flying.v[0], v - g * s, 2 * kRounding);
  EXPECT_EQ(flying.impacts, 1);
  const auto rests = solve(scene("1"));  // t_Z = 3 t_0 = 0.958 s
  EXPECT_NEAR(rests.q[0], 0, 1e-90);     // of 100 digits
  EXPECT_NEAR(rests.v[0], 0, 1e-90);
  ASSERT_EQ(rests.collapses.size(), 1u);
  EXPECT_NEAR(rests.collapses[0], t_0 * (1 + e) / (1 - e), kRounding);
}

TEST(EventArbiter, SwingsOnASpringAgainstAWall) {
  // The wall is where the spring is slack: an impact every pi / omega, each leaves e.
  const auto result = solve(R"({"q0": ["0.3"], "v0": ["0"], "T": "2", "M": [["0.5"]], "f": ["-8*q[0]"],
                                "contacts": [{"name": "wall", "gap": "q[0]", "e": "0.75"}]})");
  const double omega = 4, first = M_PI / 2 / omega, period = M_PI / omega;
  const int impacts = 1 + static_cast<int>((2 - first) / period);
  const double speed = 0.3 * omega * std::pow(0.75, impacts), s = 2 - first - (impacts - 1) * period;
  EXPECT_EQ(result.impacts, impacts);
  EXPECT_NEAR(result.q[0], speed / omega * std::sin(omega * s), kRounding);
  EXPECT_NEAR(result.v[0], speed * std::cos(omega * s), kRounding);
}

TEST(EventArbiter, LosesContactWhereTheForceEnds) {
  // A mass on a moving partner: both start at rest in contact, pressed by a spring that is stretched as they rise.
  //   (m + M) x'' = -k x from x = -a,   contact force m x'' >= 0 until x = 0, then the light one flies on freely
  const auto result = solve(
      R"({"q0": ["-0.2", "-0.2"], "v0": ["0", "0"], "T": "1", "M": [["3", "0"], ["0", "1"]], "f": ["-16*q[0]", "0"],
                                "contacts": [{"name": "push", "gap": "q[1]-q[0]", "e": "0.5"}]})");
  const double omega = 2, speed = 0.2 * omega, leaves = M_PI / 4, fast = std::sqrt(16. / 3), s = 1 - leaves;
  EXPECT_EQ(result.impacts, 0);
  EXPECT_NEAR(result.q[1], speed * s, kRounding);
  EXPECT_NEAR(result.q[0], speed / fast * std::sin(fast * s), kRounding);
}

TEST(EventArbiter, FollowsAHeavyBallThatASmallOneStops) {
  // Without forces: the small ball between the wall and the heavy one; each loses speed in every impact until both
  // stand.
  const double m_0 = 0.1, m_1 = 1, e_0 = 0.3, e_1 = 0.2;
  const auto result = solve(R"({"q0": ["0.5", "1"], "v0": ["0", "-1"], "T": "5", "M": [["0.1", "0"], ["0", "1"]],
                                "f": ["0", "0"], "contacts": [{"name": "wall", "gap": "q[0]", "e": "0.3"},
                                                              {"name": "balls", "gap": "q[1]-q[0]", "e": "0.2"}]})");
  double t = 0, x_0 = 0.5, x_1 = 1, v_0 = 0, v_1 = -1;
  while (v_1 < -1e-12) {
    const double meet = v_0 > v_1 ? (x_1 - x_0) / (v_0 - v_1) : INFINITY, wall = v_0 < 0 ? -x_0 / v_0 : INFINITY;
    const double s = std::min(meet, wall);
    t += s;
    x_1 += v_1 * s;
    if (wall < meet) {
      x_0 = 0;
      v_0 = -e_0 * v_0;
    } else {
      const double impulse = (1 + e_1) * (v_0 - v_1) * m_0 * m_1 / (m_0 + m_1);
      x_0 = x_1;
      v_0 -= impulse / m_0;
      v_1 += impulse / m_1;
    }
  }
  ASSERT_EQ(result.collapses.size(), 1u);
  EXPECT_NEAR(result.collapses[0], t, 1e-14);  // some twenty impacts before the times fall below rounding
  for (const double v : result.v) EXPECT_NEAR(v, 0, 1e-30);
}

class Collapses : public testing::TestWithParam<reference::GroundTruth> {};

TEST_P(Collapses, EndAsAnotherProgramFoundThem) {
  const auto& truth = GetParam();
  const auto problem = read_scene_file(reference_data("collapses.json") + "#" + truth.id);
  const auto result = EventArbiter(*problem).solve();
  for (int k = 0; k < problem->n_q(); ++k) {
    EXPECT_NEAR(result.q[static_cast<std::size_t>(k)], truth.q[k], kRounding);
    EXPECT_NEAR(result.v[static_cast<std::size_t>(k)], truth.v[k], kRounding);
  }
  EXPECT_FALSE(result.collapses.empty());
}

INSTANTIATE_TEST_SUITE_P(Columns, Collapses,
                         testing::ValuesIn(reference::read_ground_truth(reference_data("collapses.json"))),
                         [](const auto& instance) { return instance.param.id; });

TEST(EventArbiter, DeclinesWhatIsNotLinear) {
  EXPECT_THROW(EventArbiter(*make_problem("pendulum_wall")), std::invalid_argument);
  EXPECT_THROW(EventArbiter(*make_problem("sliding_block")), std::invalid_argument);
}

}  // namespace
}  // namespace ricochet
