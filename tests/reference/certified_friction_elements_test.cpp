// Proven motions with friction elements, and with jumps of a force that are dry friction.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "tests/reference/decimal_balls.h"

namespace ricochet::reference::certified {
namespace {

CertifiedMotion element_motion(const std::string& scene) {
  return certified_motion(*read_scene_text(scene, "scene"), {});
}

void expect_element_value(const CertifiedNumber& number, const std::string& value) {
  EXPECT_TRUE(arb_overlaps(interval(number).get(), decimal_ball(value).get())) << number.text << ", not " << value;
}

/// A mass on a spring with `friction`, whose half swings are cosines about 1/10 and -1/10.
CertifiedMotion coulomb_oscillator(const std::string& force, const std::string& elements) {
  return element_motion(fmt::format(R"({{"q0": ["1.05"], "v0": ["0"], "T": "6", "M": [["1"]], "f": ["-10*q[0]{}"]{}}})",
                                    force, elements));
}

TEST(CertifiedFrictionElements, OscillatorStopsWhereItsAmplitudeFits) {
  const std::string element = R"(, "friction": [{"name": "guide", "Jt": [["1"]], "bound": "1"}])";
  for (const CertifiedMotion& motion : {coulomb_oscillator("", element), coulomb_oscillator("-sign(v[0])", "")}) {
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    ASSERT_EQ(motion.q.size(), 1u) << "z is no coordinate of the scene";
    expect_element_value(motion.q[0], "-0.05");
    expect_element_value(motion.v[0], "0");
    EXPECT_GE(motion.decimals(), 30);
    ASSERT_EQ(motion.events.size(), 5u);
    EXPECT_EQ(motion.events.back().kind, "slip_to_stick");
    EXPECT_EQ(motion.modes, std::vector<std::string>{"stick"});
  }
}

TEST(CertifiedFrictionElements, DrySignStops) {
  const CertifiedMotion motion = element_motion(
      R"~({"params": {"mu": "0.3", "g": "9.81"}, "q0": ["0"], "v0": ["1"], "T": "1", "M": [["1"]],
           "f": ["-mu*g*sign(v[0])"], "contacts": [{"name": "far", "gap": "q[0]+10", "e": "0.5"}]})~");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  expect_element_value(motion.q[0], "0.169894665307509344206591913013931362555215766224940536867142");  // 1 / (2 mu g)
  expect_element_value(motion.v[0], "0");
}

/// Numbers of the jump are decimal, not the doubles next to them: 0.1 + 0.2 = 0.3, exactly. The slip ends before t = 2. Otherwise
/// the motion slides on the border of two regions.
TEST(CertifiedFrictionElements, JumpsAreComparedExactly) {
  const auto grade = [](const std::string& part) {
    return element_motion(fmt::format(
                              R"~({{"q0": ["0", "0"], "v0": ["1", "0"], "T": "2", "M": [["1", "0"], ["0", "1"]],
                               "f": ["-0.3*sign(v[0]-v[1])", "({}+0.1)*sign(v[0]-v[1])"]}})~",
                              part))
        .grade;
  };
  EXPECT_EQ(grade("0.2"), Grade::proven);
  EXPECT_EQ(grade("0.20000000000000004"), Grade::open);
}

TEST(CertifiedFrictionElements, NegativeBoundIsNoMotion) {
  for (const char* bound : {"cos(t)", "0.5+cos(t)"}) {
    const CertifiedMotion motion = element_motion(fmt::format(
        R"({{"q0": ["0"], "v0": ["9"], "T": "6", "M": [["1"]], "f": ["0"],
             "friction": [{{"name": "brake", "Jt": [["1"]], "bound": "{}"}}]}})",
        bound));
    EXPECT_EQ(motion.grade, Grade::open);
    EXPECT_NE(motion.reason.find("'brake'"), std::string::npos) << motion.reason;
  }
}

TEST(CertifiedFrictionElements, ImpactsDoNotReachThem) {
  const CertifiedMotion motion = certified_motion(*read_scene_file(RICOCHET_TEST_DATA "/brake_and_bounce.json"), {});
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  for (const auto& event : motion.events) {
    if (event.kind != "impact") continue;
    ASSERT_EQ(event.Lambda_n.size(), 2u);
    EXPECT_EQ(event.contact, "floor");
    expect_element_value(event.Lambda_n[1], "0");
    EXPECT_LE(event.Lambda_n[1].radius, 1e-30);
  }
}

/// A disc that rolls with the deceleration mu_r g / (1.5 R) = 1/3 stops after 3 s; theta is no coordinate of the scene.
TEST(CertifiedFrictionElements, RollingDiscStops) {
  const CertifiedMotion motion = element_motion(R"({"q0": ["0", "0.4", "0"], "v0": ["1", "0", "2.5"], "T": "4",
    "M": [["2", "0", "0"], ["0", "2", "0"], ["0", "0", "0.16"]], "f": ["0", "-20", "0"],
    "contacts": [{"name": "ground", "gap": "q[1]-0.4", "mu": "0.5", "Jt": [["1", "0", "-0.4"]]}],
    "friction": [{"name": "rolling", "Jt": [["0", "0", "1"]], "contact": "ground", "coefficient": "0.02"}]})");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.q.size(), 3u);
  expect_element_value(motion.q[0], "1.5");
  expect_element_value(motion.q[2], "3.75");
  ASSERT_EQ(motion.events.size(), 1u);
  EXPECT_EQ(motion.events[0].contact, "rolling");
  EXPECT_EQ(motion.modes, (std::vector<std::string>{"stick", "stick"}));
}

}  // namespace
}  // namespace ricochet::reference::certified
