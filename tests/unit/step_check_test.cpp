// The last check of a step, and runs that it ends: a gap with a jump or a corner under a closed contact, and forces that
// are no numbers.
#include "methods/step_check.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

/// Two balls over a floor; T |v| is zero, so that allowed gaps are 1e-6 (1 + |q|).
class LastCheck : public testing::Test {
 protected:
  std::unique_ptr<Problem> problem = read_scene_text(
      R"({"q0": [0, 1], "v0": [0, 0], "T": 1, "M": [[1, 0], [0, 1]], "f": [0, 0],
          "contacts": [{"name": "first", "gap": "q[0]"}, {"name": "second", "gap": "q[1]"}]})",
      "balls");
  StepCheck check{*problem, 1e-6};
  Vector v = Vector::Zero(2);

  Status of(double q_0, double q_1, ContactMode first) {
    const Vector q{{q_0, q_1}};
    const std::vector<ContactMode> modes{first, ContactMode::open};
    return check(q, q, v, modes);
  }
};

TEST_F(LastCheck, WantsOpenGapsThatAreNotNegative) {
  EXPECT_EQ(of(5, 7, ContactMode::open), Status::success);
  EXPECT_EQ(of(-0.9e-6, 7, ContactMode::open), Status::success);
  EXPECT_EQ(of(-1.1e-6, 7, ContactMode::open), Status::infeasible);
  EXPECT_NE(check.message().find("contact 'first' has a gap of -1.1e-06 m"), std::string::npos) << check.message();
  EXPECT_EQ(of(0, -1, ContactMode::closed), Status::infeasible);
  EXPECT_NE(check.message().find("'second'"), std::string::npos) << check.message();
}

TEST_F(LastCheck, WantsClosedGapsOfZero) {
  EXPECT_EQ(of(0.9e-6, 7, ContactMode::closed), Status::success);
  EXPECT_EQ(of(1.1e-6, 7, ContactMode::closed), Status::infeasible);
  EXPECT_NE(check.message().find("closed contact 'first'"), std::string::npos) << check.message();
  EXPECT_EQ(of(-1.1e-6, 7, ContactMode::closed), Status::infeasible);
}

TEST_F(LastCheck, WantsNumbers) {
  EXPECT_EQ(of(std::numeric_limits<double>::quiet_NaN(), 7, ContactMode::open), Status::non_finite);
  v[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(of(0, 7, ContactMode::open), Status::non_finite);
}

Solution run_with_jump(const Problem& problem, const std::string& method) {
  Settings settings;
  settings.steps = 90;
  settings.tolerance = 1e-8;
  return make_method(method)->solve(problem, settings);
}

/// The gap jumps from the table to the floor, or up a step.
TEST(JumpingGaps, AreFollowedDownAndEndARunUpwards) {
  for (const char* step : {"-0.5", "0.2"}) {
    const auto problem = read_scene_text(
        fmt::format(R"json({{"q0": [0, 0], "v0": [2, 0], "T": 0.9, "M": [[1, 0], [0, 1]], "f": [0, "-9.81"],
            "contacts": [{{"name": "table and floor", "gap": "q[1]-if(q[0]<1,0,{})", "e": 0}}]}})json",
                    step),
        "table");
    for (const char* method :
         {"event_driven", "event_driven:radau-iia:3", "fesd_adaptive:radau-iia:3", "fesd_adaptive:gauss:3",
          "fesd:radau-iia:3,elements=as_needed", "fesd:gauss:3,elements=as_needed", "cvode:adams"}) {
      const Solution s = run_with_jump(*problem, method);
      if (step[0] == '-') {
        ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
        EXPECT_NEAR(s.q[1], -0.5, 1e-7) << method;  // fallen for 0.32 s
      } else {
        EXPECT_FALSE(s.succeeded()) << method;
        EXPECT_NE(s.message.find("table and floor"), std::string::npos) << method << ": " << s.message;
      }
    }
  }
}

/// A block slides to a corner of the ground that stops a part of its velocity.
TEST(Corners, StopTheNormalVelocity) {
  struct Ground {
    const char* height;
    double y0, vy0, slope;  ///< the first two at x = 0, with v_x = 1
  };
  for (const Ground& ground : {Ground{"max(0,0.3*(q[0]-0.5))", 0, 0, 0.3}, Ground{"0.2*abs(q[0]-0.5)", 0.1, -0.2, 0.2},
                               Ground{"if(q[0]<0.5,0,0.4*(q[0]-0.5))", 0, 0, 0.4}}) {
    const auto problem = read_scene_text(
        fmt::format(R"json({{"q0": [0, {}], "v0": [1, {}], "T": 0.6, "M": [[1, 0], [0, 1]], "f": [0, -9.81],
            "contacts": [{{"name": "ground", "gap": "q[1]-{}", "e": 0}}]}})json",
                    ground.y0, ground.vy0, ground.height),
        "corner");
    const double length = 1 + ground.slope * ground.slope, fall = ground.vy0 < 0 ? 0.2 * 9.81 / 1.04 : 0;
    // down the first face with the acceleration `fall` in x, then along the second one
    const double t_1 = fall > 0 ? (std::sqrt(1 + fall) - 1) / fall : 0.5, v_1 = 1 + fall * t_1;
    const double before = fall > 0 ? (v_1 - 0.2 * 0.2 * v_1) : v_1, v_2 = before / length;
    const double v_end = v_2 - 9.81 * ground.slope / length * (0.6 - t_1);
    for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:3", "fesd:radau-iia:3,elements=as_needed",
                               "fesd:gauss:3,elements=as_needed", "cvode:adams"}) {
      const Solution s = run_with_jump(*problem, method);
      ASSERT_TRUE(s.succeeded()) << method << ", " << ground.height << s.message;
      EXPECT_NEAR(s.v[0], v_end, 1e-6) << method << ", " << ground.height;
      EXPECT_NEAR(s.v[1], ground.slope * v_end, 1e-6) << method << ", " << ground.height;
    }
  }
}

/// The force is a number up to t = 1 only.
TEST(ForcesThatAreNoNumbers, AreNoSuccessOfAnyMethod) {
  const auto problem = read_scene_text(
      R"json({"q0": [5], "v0": [0], "T": 2, "M": [[1]], "f": ["sqrt(1-t)"],
              "contacts": [{"name": "floor", "gap": "q[0]"}]})json",
      "ends");
  for (const MethodEntry& entry : methods()) {
    if (!entry.make) continue;
    for (const std::string& method : entry.examples) {
      try {
        const Solution s = run_with_jump(*problem, method);
        EXPECT_FALSE(s.succeeded()) << method;
        EXPECT_FALSE(s.message.empty()) << method;
      } catch (const InputError&) {  // declined
      }
    }
  }
}

}  // namespace
}  // namespace ricochet
