// A rod that rests on its tip turns about it until its other end falls on the ground. The tip has drifted from the
// ground by the error of the steps, not by rounding, and takes its part of the impulse all the same.
//
// And three bodies in a row: the first impact brings two of them to rest against each other, and the load pulls them
// apart before the second impact, however soon that follows. So the second one does not find them closed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

constexpr const char* kRod = R"json({
  "params": {"l": "0.25", "a": "0.27"}, "q0": [0, "l*sin(a)", "a"], "v0": [0.07, 0, 0], "T": 0.16,
  "M": [[1, 0, 0], [0, 1, 0], [0, 0, "l**2/3"]], "f": [0, -9.81, 0],
  "contacts": [{"name": "tip", "gap": "q[1]-l*sin(q[2])", "e": 0},
               {"name": "tail", "gap": "q[1]+l*sin(q[2])", "e": 0.6, "mu": 1, "Jt": [[1, 0, "-l*sin(q[2])"]]}]})json";

constexpr const char* kRow = R"json({
  "q0": [0, 0, 0], "v0": [1, 0, 0.1], "T": 0.1, "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "f": [-1, 0, 0],
  "contacts": [{"name": "left", "gap": "q[1]-q[0]", "e": 0}, {"name": "right", "gap": "q[2]-q[1]", "e": 1}]})json";

constexpr const char* kPushed = R"json({
  "q0": [0, 0, 0, 0], "v0": [2, 0, 0, 0], "T": 0.1, "M": [[1,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]],
  "f": ["2*t", -10, 0, -10],
  "contacts": [{"name": "rough", "gap": "q[1]", "e": 0, "mu": 0.7, "Jt": [[1, 0, 0, 0]]},
               {"name": "smooth", "gap": "q[3]", "e": 0, "mu": 0.1, "Jt": [[0, 0, 1, 0]]},
               {"name": "side", "gap": "q[2]-q[0]", "e": 0}]})json";

constexpr const char* kTight = R"json({
  "params": {"r": "0.05", "m": "1.4"}, "q0": ["r", "r", 0], "v0": [0.44, -0.31, 0], "T": 0.01,
  "M": [["m", 0, 0], [0, "m", 0], [0, 0, "m*r**2/2"]], "f": [0, "-m*9.81", 0],
  "contacts": [{"name": "ground", "gap": "q[1]-r", "e": 0.25},
               {"name": "left", "gap": "q[0]-r", "e": 0, "mu": 0.05, "Jt": [[0, 1, "-r"]]},
               {"name": "right", "gap": "r-q[0]", "e": 1, "mu": 0.6, "Jt": [[0, 1, "r"]]}]})json";

std::string beside_rest_name(const char* method, double tolerance) {
  std::string name = fmt::format("{}_{:g}", method, tolerance);
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
}

class ImpactBesideRest : public testing::TestWithParam<std::tuple<const char*, double>> {};

TEST_P(ImpactBesideRest, KeepsTheTipOnTheGround) {
  const auto [method, tolerance] = GetParam();
  const auto problem = read_scene_text(kRod, "rod");
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = Recording::events;
  const Solution s = make_method(method)->solve(*problem, settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.events.size(), 1U);
  const auto& impact = s.events.front();
  EXPECT_EQ(impact.kind, EventKind::impact);
  EXPECT_EQ(problem->info().contacts[impact.contact].name, "tail");
  // The rod is level then: y' - l theta' of the tip stays zero, and y' + l theta' of the tail is thrown back.
  const double l = 0.25, allowed = 100 * tolerance;  // errors of a step add up
  const auto rate = [&](double sign, const Vector& v) { return v[1] + sign * l * v[2]; };
  EXPECT_NEAR(rate(-1, impact.v_plus), 0, allowed);
  EXPECT_NEAR(rate(1, impact.v_plus), -0.6 * rate(1, impact.v_minus), allowed);
  // A quarter of the mass moves with an end, and Lambda_tip is half of Lambda_tail where the tip stays at rest.
  const double alone = -rate(1, impact.v_minus) * 1.6 / 4;
  EXPECT_NEAR(impact.Lambda_n[1], alone * 4 / 3, allowed);
  EXPECT_NEAR(impact.Lambda_n[0], alone * 2 / 3, allowed);
}

INSTANTIATE_TEST_SUITE_P(
    All, ImpactBesideRest,
    testing::Combine(testing::Values("event_driven", "event_driven:radau-iia:5", "fesd_adaptive:radau-iia:4",
                                     "fesd_adaptive:radau-iia:3", "cvode:adams", "cvode:bdf", "ida", "arkode"),
                     testing::Values(1e-6, 1e-8, 1e-10)),
    [](const auto& test) { return beside_rest_name(std::get<0>(test.param), std::get<1>(test.param)); });

class ImpactBetweenOpening : public testing::TestWithParam<const char*> {
 protected:
  Solution run(const char* scene) const {
    Settings settings;
    settings.tolerance = 1e-10;
    return make_method(GetParam())->solve(*read_scene_text(scene, "scene"), settings);
  }
};

/// The left two share their velocity, 0.5. The right two then exchange theirs, 0.5 and 0.1; the left two share again,
/// 0.3, and the load opens their contact.
TEST_P(ImpactBetweenOpening, LeavesOutWhatTheLoadOpens) {
  const Solution s = run(kRow);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const double t = 0.1;
  const Vector v = Eigen::Vector3d(0.3 - t, 0.3, 0.5), q = Eigen::Vector3d(0.3 * t - 0.5 * t * t, 0.3 * t, 0.5 * t);
  EXPECT_LE((s.v - v).norm() + (s.q - q).norm(), 1e-8);  // 100 tolerances: errors of steps add up
}

/// A disc without room between two walls strikes the ground and the right wall, on which it sticks. From there it strikes
/// the left wall, whose friction makes it slip on the right one again.
TEST_P(ImpactBetweenOpening, StickingEndsWithTheNextImpact) {
  const Solution s = run(kTight);
  ASSERT_TRUE(s.succeeded()) << s.message;
  // The ground keeps its law, v_y+ = 0.25 * 0.31, and the right wall's friction stops v_y + r omega = v_y there.
  const double r = 0.05, v_y = 0.25 * 0.31, omega = -v_y / r;
  // Left: slip v_y - r omega = 2 v_y > 0, Lambda_n = 0.44 m, friction down by mu Lambda_n, which turns the disc, too.
  const double change = 0.05 * 0.44, t = 0.01;
  EXPECT_NEAR(s.v[1], v_y - change - 9.81 * t, 1e-8);
  EXPECT_NEAR(s.v[2], omega + 2 * change / r, 1e-8);
}

/// A block strikes the one before it, and both have 1 m/s. A load pushes the first one more and more, but the ground holds
/// it by more than that, so that the other one leaves at once.
TEST_P(ImpactBetweenOpening, FrictionPullsBlocksApart) {
  const Solution s = run(kPushed);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const double t = 0.1;
  EXPECT_NEAR(s.v[0], 1 - 7 * t + t * t, 1e-8);  // 100 tolerances: errors of steps add up
  EXPECT_NEAR(s.v[2], 1 - t, 1e-8);
}

INSTANTIATE_TEST_SUITE_P(All, ImpactBetweenOpening,
                         testing::Values("event_driven", "fesd_adaptive:radau-iia:4", "cvode:adams", "ida", "arkode"),
                         [](const auto& test) { return beside_rest_name(test.param, 1e-10); });

/// A heavy body falls on another one, which a light one holds above the floor: the load presses them together, however
/// large rounding of the light one's acceleration is.
TEST(ImpactBesideRest, OfAHeavyBodyOnALightOne) {
  const auto problem = read_scene_text(R"json({
      "q0": [0, 0, 0], "v0": [0, 0, -0.11], "T": 0.01, "M": [["1e-3", 0, 0], [0, "1e3", 0], [0, 0, "1e3"]],
      "f": ["-9.81e-3", "-9.81e3", "-9.81e3"],
      "contacts": [{"name": "floor", "gap": "q[0]", "e": 0.6}, {"name": "lower", "gap": "q[1]-q[0]", "e": 0.2},
                   {"name": "upper", "gap": "q[2]-q[1]", "e": 1}]})json",
                                       "pile");
  for (const char* method :
       {"event_driven", "fesd_adaptive:radau-iia:4", "fesd:radau-iia:3,elements=as_needed", "cvode:adams", "ida"}) {
    Settings settings;
    settings.tolerance = 1e-10;
    settings.steps = 1000;
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.v[1], 0, 1e-8) << method;  // 100 tolerances: errors of steps add up
    EXPECT_NEAR(s.v[2], 0.11 - 9.81 * 0.01, 1e-8) << method;
  }
}

}  // namespace
}  // namespace ricochet
