// Impacts that follow each other at one instant, between bodies that touch from the start: Newton's law again and
// again, at the contacts that do not part. Bodies on a line without forces, so that the impacts can be counted by hand.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kDuration = 0.01;
const std::vector<std::string> kMethods = {"fesd_adaptive:radau-iia:4", "fesd:radau-iia:2", "event_driven",
                                           "cvode:adams", "cvode:bdf"};

/// Bodies of 1, 2 and 3 kg in a row from q = 0 on, 0.2 m from centre to centre.
Solution solve(const std::string& method, const std::string& v0, const std::string& contacts) {
  const auto problem = read_scene_text(
      fmt::format(R"({{"q0": ["0", "0.2", "0.4"], "v0": [{}], "T": "{}", "M": [["1", "0", "0"], ["0", "2", "0"], ["0",
                      "0", "3"]], "f": ["0", "0", "0"], "contacts": [{}]}})",
                  v0, kDuration, contacts),
      "row");
  Settings settings;
  settings.steps = 3;
  settings.tolerance = 1e-10;
  const Solution s = make_method(method)->solve(*problem, settings);
  for (const Event& e : s.events) {
    const Vector balance =
        problem->mass_matrix(e.q) * (e.v_plus - e.v_minus) - problem->normal_jacobian(e.q) * e.Lambda_n;
    EXPECT_LE(balance.cwiseAbs().maxCoeff(), 1e-13) << method << ": an event has the impulses of all its impacts";
  }
  return s;
}

std::string wall(const char* gap, double eps_r) {
  return fmt::format(R"({{"name": "wall", "gap": "{}", "e": "{}"}})", gap, eps_r);
}
std::string pair(int left, double eps_r) {
  return fmt::format(R"({{"name": "pair{0}", "gap": "q[{1}]-q[{0}]-0.2", "e": "{2}"}})", left, left + 1, eps_r);
}

/// Newton's law for two bodies by themselves.
void collide(double m_left, double m_right, double eps_r, double& v_left, double& v_right) {
  const double impulse = (1 + eps_r) * (v_left - v_right) * m_left * m_right / (m_left + m_right);
  v_left -= impulse / m_left;
  v_right += impulse / m_right;
}

/// A body that leaves a wall is sent back by its neighbour: with the wall's restitution in the same law it would be
/// sent into the wall.
TEST(ImpactSequence, SendsABodyBackAgainstTheWallThatItLeaves) {
  const double e = 0.9, e_wall = 0.5;
  double v_1 = 2, v_2 = -1;
  int impacts = 0;
  while (v_1 > v_2 || v_2 > 0) {  // the wall is behind body 2
    if (v_1 > v_2)
      collide(2, 3, e, v_1, v_2);
    else
      v_2 *= -e_wall;
    ++impacts;
  }
  ASSERT_EQ(impacts, 2);
  for (const auto& method : kMethods) {
    const Solution s = solve(method, R"("0", "2", "-1")", pair(1, e) + "," + wall("0.4-q[2]", e_wall));
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.v[1], v_1, 1e-13) << method;  // of velocities of 2 m/s
    EXPECT_NEAR(s.v[2], v_2, 1e-13) << method;
    EXPECT_NEAR(s.q[2], 0.4 + v_2 * kDuration, 1e-13) << method;
  }
}

/// Two bodies that rest against each other are struck together, and once more when the one that struck them comes back
/// from the wall: nothing has parted them.
TEST(ImpactSequence, StrikesTogetherWhatRestsTogether) {
  const double e = 0.95, e_wall = 0.9;
  double v_0 = 1, v_12 = 0;
  int impacts = 0;
  while (v_0 > v_12 || v_0 < 0) {
    if (v_0 > v_12)
      collide(1, 5, e, v_0, v_12);
    else
      v_0 *= -e_wall;
    ++impacts;
  }
  ASSERT_EQ(impacts, 3);
  for (const auto& method : kMethods) {
    const Solution s = solve(method, R"("1", "0", "0")", wall("q[0]", e_wall) + "," + pair(0, e) + "," + pair(1, 0.7));
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.v[0], v_0, 1e-13) << method;
    EXPECT_NEAR(s.v[1], v_12, 1e-13) << method;
    EXPECT_NEAR(s.v[2], v_12, 1e-13) << method;
  }
}

}  // namespace
}  // namespace ricochet
