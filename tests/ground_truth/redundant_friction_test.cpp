// Sticking contacts whose forces are not unique: where the motion is, some division of the forces keeps it.
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve(const Problem& problem, const std::string& method) {
  Settings settings;
  settings.steps = 200;
  settings.tolerance = 1e-10;
  settings.audit = true;
  return make_method(method)->solve(problem, settings);
}

/// A pendulum that leans on a wall: one way to go, and two forces along it. Their smallest division has a friction
/// force of J_t / J_n = tan(0.62) = 0.71 of the normal one, outside of the cone; no friction at all holds it as well.
TEST(RedundantFriction, APendulumLeansOnARoughWall) {
  const auto problem = read_scene_text(
      R"scene({"params": {"l": "0.4", "mu": "0.3"}, "q0": ["0.62"], "v0": ["-1"], "T": "0.8", "M": [["l*l"]],
          "f": ["-9.81*l*sin(q[0])"], "contacts": [{"name": "wall", "gap": "l*sin(q[0])-l*sin(0.62)", "e": "0",
          "mu": "mu", "Jt": [["l*sin(q[0])"]]}]})scene",
      "leaning pendulum");
  for (const char* method : {"fesd_adaptive:radau-iia:4", "fesd:radau-iia:3", "cvode:adams"}) {
    const Solution s = solve(*problem, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[0], 0.62, 1e-13) << method;
    EXPECT_NEAR(s.v[0], 0, 1e-13) << method;
    EXPECT_LE(s.max_residual(), 1e-10) << method << ": the forces reported are inside the cone";
  }
}

/// The end of a double pendulum between two walls that both touch it slides up and down. With enough force between the
/// walls it would stick anywhere: that division of forces is never taken.
TEST(RedundantFriction, AWedgeIsNotTakenForRest) {
  const auto problem = read_scene_file(test_data("pendulum_between_walls.json"));
  const Solution exact = solve(*problem, "cvode:adams"), s = solve(*problem, "fesd_adaptive:radau-iia:4");
  ASSERT_TRUE(exact.succeeded()) << exact.message;
  ASSERT_GT(exact.v.norm(), 1);
  if (s.succeeded())
    EXPECT_LE((s.v - exact.v).norm(), 1e-5) << "CVODE at 1e-10 through nine events";
  else
    EXPECT_NE(s.message.find("contact '"), std::string::npos) << s.message;
}

/// Masses on rods, both ends on rough ground, that random scenes found: infeasible with the smallest forces.
TEST(RedundantFriction, RodsThatStickAtBothEnds) {
  const auto problem = read_scene_file(test_data("rods_that_stick.json"));
  const Solution exact = solve(*problem, "cvode:adams"), s = solve(*problem, "fesd_adaptive:radau-iia:4");
  ASSERT_TRUE(exact.succeeded()) << exact.message;
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LE((s.q - exact.q).lpNorm<Eigen::Infinity>(), 1e-7);  // CVODE at 1e-10 through a dozen events
  EXPECT_LE((s.v - exact.v).lpNorm<Eigen::Infinity>(), 1e-7);
}

}  // namespace
}  // namespace ricochet
