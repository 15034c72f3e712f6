// Proofs of motions whose formulas bend or jump, against closed forms.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "tests/reference/decimal_balls.h"

namespace ricochet::reference::certified {
namespace {

constexpr const char* kFarFloor = R"s({"name": "floor", "gap": "q[0]+100"})s";

/// A scene of one coordinate with unit mass.
std::string one_body(const std::string& q, const std::string& v, const std::string& force, const std::string& T,
                     const std::string& contact = kFarFloor) {
  return fmt::format(R"s({{"q0": ["{}"], "v0": ["{}"], "M": [["1"]], "f": ["{}"], "contacts": [{}], "T": "{}"}})s", q,
                     v, force, contact, T);
}

/// A point of unit mass in the plane.
std::string point(const std::string& v, const std::string& force, const std::string& contact, const std::string& T) {
  return fmt::format(
      R"s({{"q0": ["0", "0"], "v0": ["{}", "0"], "M": [["1", "0"], ["0", "1"]], "f": [{}], "contacts": [{}], "T": "{}"}})s",
      v, force, contact, T);
}

CertifiedMotion switched_motion(const std::string& scene, const Options& options = {}) {
  return certified_motion(*read_scene_text(scene, "scene"), options);
}

std::string kinds_of(const CertifiedMotion& motion) {
  std::string kinds;
  for (const CertifiedEvent& event : motion.events) kinds += (kinds.empty() ? "" : " ") + event.kind;
  return kinds;
}

void expect_is(const CertifiedNumber& number, const std::string& exact) {
  Ball difference = Precision{kTextBits, 1}.sub(interval(number), decimal_ball(exact)), bound;
  arb_set_str(bound.get(), "0 +/- 1e-28", kTextBits);
  EXPECT_TRUE(arb_contains(bound.get(), difference.get())) << number.text << ", not " << exact;
}

/// All of q, then v. @param kinds  of the events
void expect_proven(const CertifiedMotion& motion, const std::string& kinds, const std::vector<std::string>& state) {
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_EQ(kinds_of(motion), kinds);
  EXPECT_GE(motion.decimals(), 30);
  const std::size_t n = motion.q.size();
  for (std::size_t k = 0; k < 2 * n; ++k) expect_is(k < n ? motion.q[k] : motion.v[k - n], state[k]);
}

void expect_open(const std::string& scene, const std::string& reason) {
  const auto motion = switched_motion(scene);
  EXPECT_EQ(motion.grade, Grade::open) << scene;
  EXPECT_NE(motion.reason.find(reason), std::string::npos) << motion.reason;
}

/// Stiffness 1 for q > 0 and 4 for q < 0: the period is pi + pi/2.
TEST(CertifiedRegions, TwoSprings) {
  const auto motion = switched_motion(one_body("1", "0", "-if(q[0]>0,1,4)*q[0]", "3*pi/2"));
  expect_proven(motion, "border border", {"1", "0"});
  expect_is(motion.events[0].time, "1.5707963267948966192313216916397514420985846996876");
  expect_is(motion.events[1].time, "3.1415926535897932384626433832795028841971693993751");
}

/// The force is 1 and -1 for a second each, and 0 = psi at t = 0.
TEST(CertifiedRegions, SquareWaveOfTime) {
  expect_proven(switched_motion(one_body("0", "0", "if(sin(pi*t)>0,1,-1)", "3.5")), "border border border",
                {"1.875", "0.5"});
}

/// Free between -1 and 1, and a spring of stiffness 4 beyond: |q| - 1 has another formula where q has another sign.
TEST(CertifiedRegions, BordersInsideOfBorders) {
  const auto motion = switched_motion(one_body("0", "1", "-4*max(0,abs(q[0])-1)*sign(q[0])", "2.5+pi/2"));
  expect_proven(motion, "border border border", {"-0.5", "-1"});
}

/// Drag -c v |v|: impacts change the sign of v. The digits are those of ln cosh and ln cos.
TEST(CertifiedRegions, ImpactsChangeTheRegion) {
  const auto motion = switched_motion(
      one_body("1000", "0", "-10-0.01*v[0]*abs(v[0])", "38.5", R"s({"name": "ground", "gap": "q[0]", "e": "0.5"})s"));
  expect_proven(motion, "impact border impact border impact",
                {"0.5823534738398355679017417279778321", "0.4329038114722777340018087718639336"});
  EXPECT_EQ(motion.no_certificate, "a formula bends or jumps");
}

/// The sign of the force -sign(v)/2 - q at rest follows from both sides. Half swings about +-1/2.
TEST(CertifiedRegions, StartOnABorder) {
  const auto motion = switched_motion(one_body("2", "0", "-0.5*sign(v[0]-q[0]+2)-q[0]", "1"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_EQ(kinds_of(motion), "");
  expect_proven(switched_motion(one_body("0", "0", "if(q[0]>0,2,-2)+4", "1")), "", {"3", "6"});
}

/// Both sides lead to psi = q + v = 0, or away from it.
TEST(CertifiedRegions, SlidingAndBranchingStayOpen) {
  const auto across = [](const char* v) {  // the jump is no friction of q[0], because it pushes q[1]
    return point(v, R"s("-5*sign(q[0]+v[0])", "-3*sign(q[0]+v[0])")s", kFarFloor, "2");
  };
  expect_open(across("1"), "slides on");
  expect_open(across("0"), "at t = 0, or is not unique");
  expect_open(one_body("0", "0", "5*sign(q[0]+v[0])", "2"), "at t = 0, or is not unique");
  expect_open(one_body("0", "0", "if(q[0]>0,5,-5)", "2"), "at t = 0, or is not unique");
  expect_open(one_body("0", "0", "abs(q[0])", "1"), "undecided how the motion leaves");
  expect_open(one_body("0", "0", "t+if(v[0]>0,1,-1)*t/2", "1"), "undecided how the motion leaves");
}

/// Touches q = 0 with v = 0 at t = 1.
TEST(CertifiedRegions, TouchedBordersStayOpen) {
  expect_open(one_body("1", "-2", "2+if(q[0]>0,0,1)", "2"), "");
}

/// The force exceeds friction, or the weight, from t = 1 on.
TEST(CertifiedRegions, ModesAreDecidedAgain) {
  const std::string ground = R"s({"name": "ground", "gap": "q[1]", "mu": "0.5", "Jt": [["1", "0"]]})s";
  const auto slips = switched_motion(point("0", R"s("if(t<1,1,6)", "-10")s", ground, "2"));
  expect_proven(slips, "border", {"0.5", "0", "1", "0"});
  EXPECT_EQ(slips.events[0].modes[0], "slip+");
  const auto opens = switched_motion(point("0", R"s("0", "if(t<1,-10,10)")s", ground, "2"));
  expect_proven(opens, "border", {"0", "5", "0", "10"});
  EXPECT_EQ(opens.events[0].modes[0], "open");
}

/// A belt that reverses: v_t jumps. A belt whose speed only bends: v_t = 0 stays.
TEST(CertifiedRegions, DrivesOfContacts) {
  const auto belt = [](const std::string& speed) {
    return fmt::format(R"s({{"name": "belt", "gap": "q[1]", "mu": "0.1", "Jt": [["1", "0"]], "vt_drive": ["-({})"]}})s",
                       speed);
  };
  const auto jumps = switched_motion(point("0", R"s("0", "-10")s", belt("if(t<1,2,-2)"), "1.5"));
  expect_proven(jumps, "border", {"0.875", "0", "0.5", "0"});
  EXPECT_EQ(jumps.events[0].modes[0], "slip+");
  const auto bends = switched_motion(point("0.5", R"s("0", "-10")s", belt("abs(t-1)/2"), "2"));
  expect_proven(bends, "border", {"0.5", "0", "0.5", "0"});
  EXPECT_EQ(bends.events[0].modes[0], "stick");
}

/// The gap jumps where a table ends.
TEST(CertifiedRegions, BlockFallsFromATable) {
  const auto motion = switched_motion(point("2", R"s("0", "-9.81")s", R"s({"name": "table and floor", "e": "0.5",
      "gap": "q[1]-if(q[0]<1,0,-0.5)"})s",
                                            "0.9"));
  expect_proven(motion, "border impact",
                {"1.8", "-0.4055448283961009676436042759413514", "2", "0.7741379290097475808909893101466215"});
  // A step up is no motion.
  expect_open(point("2", R"s("0", "-9.81")s", R"s({"name": "step", "gap": "q[1]-if(q[0]<1,0,0.5)"
  })s",
                    "0.9"),
              "step changes");
}

/// At the foot of a ramp the velocity (1, 0) becomes (1, s) / (1 + s^2), s = 0.3, and (-1, -s) / (1 + s^2) becomes
/// (-1, 0) / (1 + s^2).
TEST(CertifiedRegions, PlasticImpactsAtTheFootOfARamp) {
  const auto motion = switched_motion(point("1", R"s("0", "-9.81")s", R"s({"name": "ground and ramp", "e": "0",
      "gap": "q[1]-max(0,0.3*(q[0]-0.5))"})s",
                                            "1.3"));
  expect_proven(motion, "border impact border impact",
                {"0.3895217075504930062627226165648857", "0", "-0.917431192660550458715596330275229357798", "0"});
  // With friction, or thrown back to the ground before it, it is not decided.
  expect_open(point("1", R"s("0", "-9.81")s", R"s({"name": "ramp", "e": "0.9", "gap": "q[1]-max(0,3*(q[0]-0.5))"
  })s",
                    "1"),
              "");
  expect_open(point("1", R"s("0", "-9.81")s", R"s({"name": "ramp", "e": "0", "mu": "0.1", "Jt": [["1", "0"]],
      "gap": "q[1]-max(0,0.3*(q[0]-0.5))"
  })s",
                    "1"),
              "");
}

/// Over a convex edge, flight; over a border with the same slope, the contact stays closed.
TEST(CertifiedRegions, EdgesAndSmoothBorders) {
  const auto edge =
      switched_motion(point("1", R"s("0", "-10")s", R"s({"name": "edge", "gap": "q[1]-min(0,1-q[0])"})s", "1.1"));
  expect_proven(edge, "border", {"1.1", "-0.05", "1", "-1"});
  EXPECT_EQ(edge.modes[0], "open");
  const auto bowl =
      switched_motion(point("1", R"s("0", "-10")s", R"s({"name": "bowl", "gap": "q[1]-if(q[0]<0.5,0,(q[0]-0.5)**2)"
  })s",
                            "0.7"));
  ASSERT_EQ(bowl.grade, Grade::proven) << bowl.reason;
  EXPECT_EQ(kinds_of(bowl), "border");
  EXPECT_EQ(bowl.modes[0], "closed");
  const Precision a{kTextBits, 1};
  const Ball x = a.sub(interval(bowl.q[0]), decimal_ball("0.5")), y = interval(bowl.q[1]);
  EXPECT_TRUE(arb_overlaps(y.get(), a.mul(x, x).get()));
  Ball energy = a.mul(Ball(20.0), y);
  for (const auto& number : bowl.v) energy = a.add(energy, a.mul(interval(number), interval(number)));
  EXPECT_TRUE(arb_contains(energy.get(), Ball(1.0).get()));
}

/// Slows down with 5/8 from -1 until q = 0, where v = 1, then with 1 until it sticks at 1/2.
TEST(CertifiedRegions, FrictionElementsPassBorders) {
  const std::string scene = R"s({"q0": ["-1"], "v0": ["3/2"], "M": [["1"]], "f": ["-if(q[0]<0,0,3/8)"], "T": "3",
      "friction": [{"name": "guide", "Jt": [["1"]], "bound": "5/8"}]})s";
  expect_proven(switched_motion(scene), "border slip_to_stick", {"0.5", "0"});
}

TEST(CertifiedRegions, ScenesWithoutContactsMayStayOpen) {  // the second border is zero wherever the first one is
  const std::string scene =
      R"s({"q0": ["0.2"], "v0": ["-0.2"], "M": [["1"]], "f": ["-10*q[0]-max(158*max(q[0]+0.1,0)*(1+v[0]/4),0)"],
      "contacts": [], "T": "1.6"})s";
  expect_open(scene, "at the same time");
}

/// Two proofs of one motion, with boxes and with the mean value form, and more bits, overlap.
TEST(CertifiedRegions, RunsAgree) {
  const auto problem = read_scene_file(RICOCHET_TEST_DATA "/moving_table.json");
  const auto boxes = certified_motion(*problem);
  const auto form = certified_motion(*problem, {.bits = 300, .mean_value_form = true});
  ASSERT_EQ(boxes.grade, Grade::proven) << boxes.reason;
  ASSERT_EQ(kinds_of(boxes), kinds_of(form)) << form.reason;
  EXPECT_TRUE(form.mean_value_form);
  for (std::size_t k = 0; k < boxes.q.size(); ++k) {
    EXPECT_TRUE(arb_overlaps(interval(boxes.q[k]).get(), interval(form.q[k]).get()));
    EXPECT_TRUE(arb_overlaps(interval(boxes.v[k]).get(), interval(form.v[k]).get()));
  }
}

}  // namespace
}  // namespace ricochet::reference::certified
