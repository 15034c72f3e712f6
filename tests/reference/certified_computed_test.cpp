// Motions of grade `computed`, against answers of another program and closed forms; impacts at exactly the same time.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/attempt.h"
#include "reference/certified/ball.h"
#include "reference/certified/computed_motion.h"
#include "reference/certified/first_root.h"
#include "tests/reference/decimal_balls.h"
#include "tests/reference/stated_collapses.h"

namespace ricochet::reference::certified {
namespace {

constexpr slong kTestBits = 600;
/// Whether the number and a decimal text differ by less than the radius and one unit of the place `decimals`.
bool agrees(const CertifiedNumber& number, const std::string& text, int decimals) {
  Ball difference, most;
  arb_sub(difference.get(), decimal_ball(number.text).get(), decimal_ball(text).get(), kTestBits);
  difference = Ball(difference.get());
  arb_abs(difference.get(), difference.get());
  most = decimal_ball(fmt::format("1e-{}", decimals));
  arb_add(most.get(), most.get(), Ball(number.radius).get(), kTestBits);
  return arb_lt(difference.get(), most.get()) != 0;
}

/// Columns of balls, computed event by event in Python with 100 and 160 digits.
class ComputedCollapse : public testing::TestWithParam<const char*> {};

TEST_P(ComputedCollapse, EndsInTheStoredState) {
  const auto stated = stated_collapse(GetParam());
  Options options;
  options.max_seconds = 100;
  CertifiedMotion motion;
  const TimeLimit limit(options.max_seconds);
  take_computed(motion, *read_scene_file(std::string(kCollapses) + "#" + GetParam()), options, limit);
  ASSERT_EQ(motion.grade, Grade::computed) << motion.reason;
  EXPECT_FALSE(motion.assumptions.empty());
  EXPECT_GE(motion.decimals(), 30);
  constexpr int kStored = 33;  // significant digits of velocities up to 10 m/s
  for (std::size_t k = 0; k < motion.q.size(); ++k) {
    EXPECT_TRUE(agrees(motion.q[k], stated["final"]["q"][k], kStored)) << motion.q[k].text;
    EXPECT_TRUE(agrees(motion.v[k], stated["final"]["v"][k], kStored)) << motion.v[k].text;
  }
  std::size_t n = 0;
  for (const auto& event : motion.events) {
    if (event.kind != "zeno_end") continue;
    ASSERT_LT(n, stated["collapses"].size());
    EXPECT_TRUE(agrees(event.time, stated["collapses"][n], 18)) << event.time.text;
    ++n;
  }
  EXPECT_EQ(n, stated["collapses"].size());
}

INSTANTIATE_TEST_SUITE_P(Columns, ComputedCollapse,
                         testing::Values("column_117", "column_468", "column_634", "column_449", "two_balls_13"),
                         [](const auto& test) { return std::string(test.param); });

/// Impacts of three contacts accumulate, and their limits accumulate, too.
TEST(CertifiedComputed, LimitsThatAccumulateAreNotProven) {
  const auto motion = certified_motion(*read_scene_file(RICOCHET_TEST_DATA "/balls_with_springs.json"),
                                       {.max_seconds = 100});  // a few on an idle machine
  ASSERT_EQ(motion.grade, Grade::computed) << motion.reason;
  EXPECT_GE(motion.decimals(), 30);
}

/// Without a second run there is no grade, and a run without a cut is no computed one.
TEST(CertifiedComputed, NothingIsTakenAsZeroWithoutACut) {
  const auto problem = read_scene_file(RICOCHET_TEST_DATA "/balls_with_springs.json");
  Options options;
  options.bits = 1000;
  const TimeLimit limit(20);
  const Attempt proof = attempt(*problem, options, limit);
  EXPECT_EQ(proof.motion.grade, Grade::open);
  EXPECT_TRUE(proof.motion.assumptions.empty());
  EXPECT_EQ(attempt(*problem, options, limit, 40).motion.grade, Grade::computed);
}

/// The relative motion of two balls that a spring parts after a plastic impact is A (1 - cos w t): it touches zero.
TEST(CertifiedComputed, GapThatTouchesZeroIsNoImpact) {
  const auto motion = certified_motion(*read_scene_text(
      R"scene({"q0": ["0", "1"], "v0": ["0", "-4"], "T": "2.5", "M": [["1", "0"], ["0", "1"]],
          "f": ["-8*(1-q[1]+q[0])", "8*(1-q[1]+q[0])"],
          "contacts": [{"name": "pair", "gap": "q[1]-q[0]-0.5", "e": "0"}]})scene",
      "scene"));
  ASSERT_EQ(motion.grade, Grade::computed) << motion.reason;
  ASSERT_EQ(motion.events.size(), 1u);
  ASSERT_FALSE(motion.assumptions.empty());
  EXPECT_NE(motion.assumptions[0].find("touches zero"), std::string::npos) << motion.assumptions[0];
  EXPECT_GE(motion.decimals(), 30);
}

/// A bar falls level on two corners with the same restitution: both hit at the same time, and it never turns.
std::string level_bar(const std::string& e_right, const std::string& q2) {
  return fmt::format(R"scene({{"q0": ["0.3", "{}"], "v0": ["-0.7", "0"], "T": "0.35", "M": [["2", "0"], ["0", "0.1"]],
      "f": ["-2*9.81", "0"],
      "contacts": [{{"name": "left", "gap": "q[0]-0.3*sin(q[1])-0.1*cos(q[1])", "e": "0.4"}},
                   {{"name": "right", "gap": "q[0]+0.3*sin(q[1])-0.1*cos(q[1])", "e": "{}"}}]}})scene",
                     q2, e_right);
}

TEST(CertifiedTies, LevelBarHitsWithBothCorners) {
  const auto motion = certified_motion(*read_scene_text(level_bar("0.4", "0"), "scene"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.events.size(), 2u);  // falls 0.2 m, rises again with 0.4 times the speed
  EXPECT_EQ(motion.q[1].text, "0");
  EXPECT_EQ(motion.v[1].text, "0");
  // v_1^2 = 0.49 + 0.4 g; t_1 = (v_1 - 0.7) / g; the second flight lasts 0.8 v_1 / g
  Ball g = decimal_ball("9.81"), v = decimal_ball("4.414"), t;
  arb_sqrt(v.get(), v.get(), kTestBits);
  arb_sub(t.get(), v.get(), decimal_ball("0.7").get(), kTestBits);
  arb_div(t.get(), t.get(), g.get(), kTestBits);
  EXPECT_TRUE(agrees(motion.events[0].time, decimal(t, 60).text, 36)) << motion.events[0].time.text;
  arb_mul(v.get(), v.get(), decimal_ball("0.8").get(), kTestBits);
  arb_div(v.get(), v.get(), g.get(), kTestBits);
  arb_add(t.get(), t.get(), v.get(), kTestBits);
  EXPECT_TRUE(agrees(motion.events[1].time, decimal(t, 60).text, 36)) << motion.events[1].time.text;
}

/// With other restitutions it turns after the tie.
TEST(CertifiedTies, OtherRestitutionsTurnTheBar) {
  const auto motion = certified_motion(*read_scene_text(level_bar("0.3", "0"), "scene"));
  ASSERT_GE(motion.events.size(), 1u);
  ASSERT_FALSE(motion.v.empty()) << motion.reason;
  EXPECT_NE(motion.q[1].text, "0");
}

/// Corners 1e-25 apart in height are not tied.
TEST(CertifiedTies, NearlyLevelBarHitsTwice) {
  const auto motion = certified_motion(*read_scene_text(level_bar("0.4", "1e-25"), "scene"));
  ASSERT_GE(motion.events.size(), 2u) << motion.reason;
  EXPECT_EQ(motion.events[0].contact, "left");
  EXPECT_EQ(motion.events[0].Lambda_n[1].text, "0");
}

/// f = (x - 1/3)^2 + d in the variable tau: positive for d > 0, taken for positive above -graze only.
TEST(FirstRoots, ConvexMinimumIsDecidedByItsValue) {
  const Precision precision{400, 8};
  const auto kind = [&](const char* d, double graze) {
    BoundedPolynomial f;
    Ball third, c;
    arb_set_str(third.get(), "1", 400);
    arb_div_si(third.get(), third.get(), 3, 400);
    arb_sqr(c.get(), third.get(), 400);
    arb_add(c.get(), c.get(), decimal_ball(d).get(), 400);
    arb_poly_set_coeff_arb(f.p, 0, c.get());
    arb_mul_si(c.get(), third.get(), -2, 400);
    arb_poly_set_coeff_arb(f.p, 1, c.get());
    arb_poly_set_coeff_si(f.p, 2, 1);
    arb_poly_derivative(f.slope, f.p, 400);
    const FirstRoot root = first_root(f, Ball(1.0), precision, graze);
    return std::pair(root.kind, root.grazes);
  };
  using Kind = FirstRoot::Kind;
  EXPECT_EQ(kind("1e-60", 0), std::pair(Kind::none, false));
  EXPECT_EQ(kind("0", 0).first, Kind::unknown);
  EXPECT_EQ(kind("0", 1e-40), std::pair(Kind::none, true));
  EXPECT_EQ(kind("-1e-30", 1e-40).first, Kind::found);
}

/// 363 elastic bounces: t_1 = sqrt(2 h / g), then one flight after the other lasts 2 t_1.
TEST(CertifiedMotionOfManyBounces, GetsTheBitsItNeeds) {
  Options options;
  options.max_seconds = 100;
  const auto motion =
      certified_motion(*read_scene_text(R"scene({"q0": ["9.3"], "v0": ["0"], "M": [["1"]], "f": ["-9.8"],
      "contacts": [{"name": "floor", "gap": "q[0]", "e": "1"}], "T": "1000"})scene",
                                        "scene"),
                       options);
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.events.size(), 363u);
  Ball t = decimal_ball("18.6");
  arb_div(t.get(), t.get(), decimal_ball("9.8").get(), kTestBits);
  arb_sqrt(t.get(), t.get(), kTestBits);
  arb_mul_si(t.get(), t.get(), 1 + 2 * 362, kTestBits);
  EXPECT_TRUE(agrees(motion.events.back().time, decimal(t, 60).text, 36)) << motion.events.back().time.text;
}

}  // namespace
}  // namespace ricochet::reference::certified
