// Proofs of motions whose friction coefficient depends on the place or the time (varying_friction.h), against closed
// forms.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "tests/reference/decimal_balls.h"

namespace ricochet::reference::certified {
namespace {

/// A point of unit mass on the ground, with a parameter b. @param contact  fields of the contact, with mu
CertifiedMotion on_ground(const std::string& q, const std::string& v, const std::string& f, const std::string& contact,
                          const std::string& T, bool with_sensitivities = false) {
  const auto problem = read_scene_text(
      fmt::format(R"s({{"params": {{"a": "0.2", "b": "0.3"}}, "q0": [{}], "v0": [{}], "M": [["1", "0"], ["0", "1"]],
  "f": [{}], "T": "{}", "contacts": [{{"name": "ground", "gap": "q[1]", "Jt": [["1", "0"]], {}}}]}})s",
                  q, v, f, T, contact),
      "scene");
  return certified_motion(*problem, {.digits = 12, .max_seconds = 3, .with_sensitivities = with_sensitivities});
}

void expect_digits(const CertifiedNumber& number, const std::string& exact) {
  Ball difference = Precision{kTextBits, 1}.sub(interval(number), decimal_ball(exact)), bound;
  arb_set_str(bound.get(), "0 +/- 1e-9", kTextBits);  // 12 digits are asked for, and a slow machine proves fewer
  EXPECT_TRUE(arb_contains(bound.get(), difference.get())) << number.text << ", not " << exact;
}

void expect_coefficients_proven(const CertifiedMotion& motion, const std::string& kinds, const std::string& q,
                                const std::string& v) {
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  std::string found;
  for (const CertifiedEvent& event : motion.events) found += (found.empty() ? "" : " ") + event.kind;
  EXPECT_EQ(found, kinds);
  expect_digits(motion.q[0], q);
  expect_digits(motion.v[0], v);
}

/// See tests/ground_truth/varying_coefficients_test.cpp for the closed forms.
TEST(CertifiedCoefficients, BlocksOnVaryingGround) {
  const char* mu = R"~("mu": "a+b*q[0]")~";
  expect_coefficients_proven(on_ground(R"~("0","0")~", R"~("2","0")~", R"~("0","-9.81")~", mu, "0.5"), "",
                             "0.65123076177607610840806114598697047703991688703734",
                             "0.44321525394562937588551989651309537058252199348966");
  const auto rests = on_ground(R"~("0","0")~", R"~("2","0")~", R"~("0","-9.81")~", mu, "1", true);
  expect_coefficients_proven(rests, "slip_to_stick", "0.67631574829807113412424552329779908246622814129987", "0");
  ASSERT_EQ(rests.no_sensitivities, "");
  for (const auto& [variable, dq] : {std::pair{"param:a", "-1.6786413601100128327356382085466705602871517123648"},
                                     std::pair{"param:b", "-0.5676457937934476126285298026474416173479963313782"}}) {
    const auto column = std::ranges::find(rests.sensitivities, variable, &CertifiedSensitivity::variable);
    ASSERT_NE(column, rests.sensitivities.end());
    ASSERT_EQ(column->reason, "");
    expect_digits(column->q[0], dq);
  }
  expect_coefficients_proven(
      on_ground(R"~("0","0")~", R"~("0","0")~", R"~("0","-9.81")~", R"~("mu": "a+b*q[0]", "vt_drive": ["-1"])~", "1"),
      "slip_to_stick", "0.7585779001703485810147560368767314013371653840828", "1");
}

/// The block begins to slip where the coefficient jumps with the time, and stops earlier where it jumps with the place.
TEST(CertifiedCoefficients, JumpsOfTheCoefficient) {
  expect_coefficients_proven(
      on_ground(R"~("0","0")~", R"~("0","0")~", R"~("3","-9")~", R"~("mu": "if(t<1/2,0.5,0.2)")~", "1.5"), "border",
      "0.6", "1.2");
  // v^2 = 4 - 2 at 1/2, and 1/4 s later at the deceleration 4.
  expect_coefficients_proven(
      on_ground(R"~("0","0")~", R"~("2","0")~", R"~("0","-10")~", R"~("mu": "if(q[0]<1/2,0.2,0.4)")~", "1"),
      "border slip_to_stick", "0.75", "0");
}

/// With mu <= 0 the scaled tangents would give the friction of |mu|.
TEST(CertifiedCoefficients, NothingIsProvenWhereItIsNotPositive) {
  for (const char* mu : {"0.2-0.3*q[0]", "(q[0]-0.5)**2-0.001", "if(q[0]<0.5,0.2,0)", "if(q[0]<0.5,0.2,-0.2)"}) {
    const auto motion =
        on_ground(R"~("0","0")~", R"~("2","0")~", R"~("0","-9.81")~", fmt::format(R"~("mu": "{}")~", mu), "0.6");
    EXPECT_EQ(motion.grade, Grade::open) << mu;
  }
}

TEST(CertifiedCoefficients, RestitutionOfTheSpeedIsOpen) {
  const auto motion =
      on_ground(R"~("0","1")~", R"~("0","0")~", R"~("0","-10")~", R"~("mu": "0", "e": "0.5/(1+vn)")~", "1");
  EXPECT_EQ(motion.grade, Grade::open);
  EXPECT_EQ(motion.reason, "the restitution of 'ground' depends on the approach speed");
}

}  // namespace
}  // namespace ricochet::reference::certified
