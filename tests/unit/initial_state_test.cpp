// Scenes that start in penetration, as measured ones do.
#include "methods/initial_state.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

std::string message_of(const auto& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// A ball of radius 0.1 whose gap is -depth.
std::unique_ptr<Problem> sunken_ball(double depth, double allowed) {
  return make_problem("bouncing_ball", {{"e", 0.5}, {"height", 0.1 - depth}}, allowed);
}

TEST(InitialState, PenetrationIsRejectedWithTheOptionThatAllowsIt) {
  const std::string error = message_of([] { make_problem("bouncing_ball", {{"height", 0.1 - 1e-6}}); });
  EXPECT_NE(error.find("the scene starts in penetration"), std::string::npos) << error;
  EXPECT_NE(error.find("--allow-penetration"), std::string::npos) << error;
  EXPECT_NE(message_of([] { sunken_ball(1e-5, 1e-6); }).find("gap(q0) >= -1e-06 is required"), std::string::npos);
}

TEST(InitialState, IsProjectedAndSaysSo) {
  const ProjectedProblem ball = project_initial_state(sunken_ball(1e-6, 1e-5));
  EXPECT_NEAR(ball.problem->info().q0[0], 0.1, 1e-16) << "one rounding of 0.1";
  EXPECT_NE(ball.note.find("'ground' had a gap of -1e-06 m"), std::string::npos) << ball.note;
  EXPECT_EQ(ball.problem->info().id, "bouncing_ball");
  Settings settings;
  settings.tolerance = 1e-10;
  const Solution s = make_method("fesd_adaptive:radau-iia:4")->solve(*ball.problem, settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_NEAR(s.q[0], 0.1, 1e-15) << "it rests";
}

TEST(InitialState, StaysWhereAllGapsAreRespected) {
  const ProjectedProblem ball = project_initial_state(sunken_ball(-0.5, 1e-5));
  EXPECT_TRUE(ball.note.empty()) << ball.note;
  EXPECT_EQ(ball.problem->info().q0[0], 0.6);
}

/// Two masses 1 and 3 on a line that overlap by d: in the norm of M the light one moves by 3/4 d, the heavy one by 1/4.
TEST(InitialState, MovesByTheLeastInTheNormOfM) {
  const double d = 1e-6;
  const auto overlapping = [&](double allowed) {
    const ParameterChanges none;
    const std::string path = testing::TempDir() + "/overlapping.json";
    FILE* file = std::fopen(path.c_str(), "w");
    fmt::print(file, R"({{"q0": [0, {:.17g}], "v0": [0, 0], "T": 1, "M": [[1, 0], [0, 3]], "f": [0, 0],
      "contacts": [{{"name": "pair", "gap": "q[1] - q[0] - 1"}}]}})",
               1 - d);
    std::fclose(file);
    return read_scene_file(path, none, allowed);
  };
  const ProjectedProblem pair = project_initial_state(overlapping(1e-5));
  EXPECT_NEAR(pair.problem->info().q0[0], -0.75 * d, 1e-15);
  EXPECT_NEAR(pair.problem->info().q0[1], 1 - 0.75 * d, 1e-15);
  EXPECT_NE(pair.note.find("q0[0] by -7.5e-07"), std::string::npos) << pair.note;
}

/// A pendulum in Cartesian coordinates whose rod is measured too long, and that moves along it, too.
TEST(InitialState, RespectsBilateralConstraintsWithItsVelocityToo) {
  const std::string path = testing::TempDir() + "/measured_pendulum.json";
  FILE* file = std::fopen(path.c_str(), "w");
  fmt::print(file, R"({{"q0": [0.600001, -0.8], "v0": [0.8, 0.60001], "T": 1, "M": [[2, 0], [0, 2]],
    "f": [0, "-2*9.81"], "contacts": [{{"name": "rod", "gap": "sqrt(q[0]**2 + q[1]**2) - 1", "bilateral": true}}]}})");
  std::fclose(file);
  EXPECT_THROW(read_scene_file(path), InputError);
  const ProjectedProblem pendulum = project_initial_state(read_scene_file(path, {}, 1e-5));
  const Vector &q = pendulum.problem->info().q0, &v = pendulum.problem->info().v0;
  EXPECT_NEAR(q.norm(), 1, 1e-15);
  EXPECT_NEAR(q.dot(v), 0, 1e-15);
  EXPECT_NEAR(q[0] / q[1], 0.600001 / -0.8, 1e-12) << "along the rod: the nearest position on the circle";
  EXPECT_NEAR(v.norm(), 1, 2e-5) << "and no other velocity is lost";
}

}  // namespace
}  // namespace ricochet
