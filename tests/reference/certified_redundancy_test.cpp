// Redundant contacts, and impulses that are exactly zero.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "reference/certified/redundant_rows.h"

namespace ricochet::reference::certified {
namespace {

const Precision kOfRows{160, 1};

std::string data(const std::string& name) {
  return RICOCHET_TEST_DATA "/" + name;
}

double value_of(const CertifiedNumber& number) {
  return std::stod(number.text);
}

CertifiedMotion motion_of_scene(const std::string& text) {
  return certified_motion(*read_scene_text(text, "scene"), {});
}

/// A scene of reference_scenes.json.
CertifiedMotion motion_of_case(const std::string& id) {
  std::ifstream file(data("reference_scenes.json"));
  const auto cases = nlohmann::json::parse(file)["cases"];
  for (const auto& stated : cases) {
    if (stated["id"] == id) return motion_of_scene(stated["problem"].dump());
  }
  throw std::runtime_error("no case " + id);
}

/// Random rows on the coordinates 1 and 3 of five lock these two; an entry elsewhere frees what it touches.
TEST(RedundantRows, LockWhatTheyReach) {
  std::mt19937 random(3);
  const auto number = [&] { return Ball(1 + static_cast<double>(random() % 1000) / 1000); };
  for (int n = 0; n < 50; ++n) {
    BallMatrix rows(3, std::vector<Ball>(5));
    for (int r = 0; r < 3; ++r) {
      rows[r][1] = number();
      rows[r][3] = r == 0 ? -number() : number();
    }
    EXPECT_EQ(locked_coordinates(rows, kOfRows), (std::vector<int>{1, 3}));
    rows.pop_back();
    rows[1][0] = number();
    EXPECT_TRUE(locked_coordinates(rows, kOfRows).empty());
    rows.push_back(std::vector<Ball>(5));
    rows.back()[0] = number();
    EXPECT_EQ(locked_coordinates(rows, kOfRows), (std::vector<int>{0, 1, 3}));
    rows.back()[0].widen(Magnitude(Ball(4.0)).get());  // may be zero
    EXPECT_TRUE(locked_coordinates(rows, kOfRows).empty());
  }
}

/// u - l_1 - l_2 = -g, u = 0, u = b: forces l_1 + l_2 = g, where l_2 = z is free. Random inequalities of l_1 and l_2 against
/// the interval that they leave for z; for b != 0 there is no solution with bounds.
TEST(RedundantRows, RandomInequalitiesAreDecided) {
  std::mt19937 random(5);
  const auto number = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 4096) / 4096;
  };
  int n_refuted = 0, n_feasible = 0;
  for (int n = 0; n < 500; ++n) {
    const double g = number(0.5, 2);
    const BallMatrix A{{Ball(1.0), Ball(-1.0), Ball(-1.0)}, {Ball(1.0), Ball(), Ball()}, {Ball(1.0), Ball(), Ball()}};
    const auto system = RedundantRow::without(A, {Ball(-g), Ball(), Ball()}, 2, kOfRows);
    const auto contradiction = RedundantRow::without(A, {Ball(-g), Ball(), Ball(0.5)}, 2, kOfRows);
    ASSERT_TRUE(system && contradiction);
    std::vector<LinearForm> forms;
    double least = -1e300, most = 1e300;
    for (int k = 0; k < 4; ++k) {
      const double c_1 = number(-1, 1), c_2 = number(-1, 1), d = number(-1, 1);
      forms.push_back({{Ball(), Ball(c_1), Ball(c_2)}, Ball(d)});
      const double slope = c_2 - c_1, bound = -(d + c_1 * g) / slope;  // c_1 (g - z) + c_2 z + d >= 0
      (slope > 0 ? least : most) = slope > 0 ? std::max(least, bound) : std::min(most, bound);
    }
    EXPECT_EQ(system->is_refuted(forms), least > most);
    EXPECT_EQ(system->feasible(forms).has_value(), least < most);
    const bool is_bounded = least > -1e300 && most < 1e300;
    EXPECT_TRUE(!is_bounded || contradiction->is_refuted(forms));
    ++(least > most ? n_refuted : n_feasible);
  }
  EXPECT_GT(n_refuted, 20);
  EXPECT_GT(n_feasible, 20);
}

/// Closed forms and states of CVODE at 1e-11, by `ricochet run --method cvode:adams`.
TEST(RedundantContacts, MotionsOfScenesAreProven) {
  const auto press = certified_motion(*read_scene_file(data("press.json")), {});
  ASSERT_EQ(press.grade, Grade::proven) << press.reason;
  EXPECT_NEAR(value_of(press.q[0]), 0.1, 1e-17);
  const auto stool = motion_of_case("three_legs");
  ASSERT_EQ(stool.grade, Grade::proven) << stool.reason;
  for (const auto* numbers : {&stool.q, &stool.v}) {
    for (const auto& number : *numbers) EXPECT_LT(std::abs(value_of(number)), 1e-30);
  }
  const auto disc = certified_motion(*make_problem("disc_in_chute"), {});
  ASSERT_EQ(disc.grade, Grade::proven) << disc.reason;
  EXPECT_NEAR(value_of(disc.q[2]), 11.5732575605, 1e-9);
  EXPECT_EQ(disc.modes, (std::vector<std::string>{"stick", "stick"}));
  const auto rod = motion_of_case("rod_lies_on_both_ends");  // both ends slip, and stop at once
  ASSERT_EQ(rod.grade, Grade::proven) << rod.reason;
  EXPECT_NEAR(value_of(rod.q[0]), -0.21011922490, 1e-9);
  EXPECT_EQ(rod.events.back().kind, "slip_to_stick");
  EXPECT_EQ(rod.modes, (std::vector<std::string>{"stick", "stick"}));
  const auto crank = certified_motion(*read_scene_file(data("crank_with_friction.json")), {});
  ASSERT_EQ(crank.grade, Grade::proven) << crank.reason;  // reversals at the dead centres
  EXPECT_NEAR(value_of(crank.q[0]), 0.29405781146, 1e-8);
}

TEST(RedundantContacts, ImpactsWithoutImpulseAreProven) {
  const auto rest = motion_of_case("jointed_masses_rest");
  ASSERT_EQ(rest.grade, Grade::proven) << rest.reason;
  ASSERT_EQ(rest.events.size(), 2u);
  EXPECT_EQ(rest.events[1].Lambda_n[2].text, "0");  // g1 touches, and no momentum reaches it along the rod
  EXPECT_EQ(rest.events[1].Lambda_n[2].radius, 0);
  for (const auto& number : rest.v) EXPECT_LT(std::abs(value_of(number)), 1e-30);
  const auto rod = motion_of_case("rod_comes_to_lie");
  ASSERT_EQ(rod.grade, Grade::proven) << rod.reason;
  EXPECT_NEAR(value_of(rod.q[0]), 0.08377519155, 1e-9);
  const auto slip = motion_of_case("jointed_masses_slip");
  ASSERT_EQ(slip.grade, Grade::proven) << slip.reason;
  EXPECT_EQ(slip.modes[2], "stick");
}

/// A mass on two equal floors that is pulled off at t = 1: it rests until then, and which force ends is not decided.
TEST(RedundantContacts, ForcesThatEndAreNotDecided) {
  const std::string scene = R"json({{"q0": ["0"], "v0": ["0"], "T": "{}", "M": [["1"]], "f": ["t-1"],
      "contacts": [{{"name": "floor", "gap": "q[0]"}}, {{"name": "twin", "gap": "2*q[0]"}}]}})json";
  const auto before = motion_of_scene(fmt::format(fmt::runtime(scene), "0.9"));
  ASSERT_EQ(before.grade, Grade::proven) << before.reason;
  EXPECT_LT(std::abs(value_of(before.q[0])), 1e-30);
  const auto after = motion_of_scene(fmt::format(fmt::runtime(scene), "1.5"));
  EXPECT_EQ(after.grade, Grade::open);
  EXPECT_TRUE(after.reason.find("a force of redundant contacts reaches a limit") != std::string::npos) << after.reason;
}

/// A press that comes down leaves no room; one that goes up opens, and the ball stays.
TEST(RedundantContacts, MovingContactsAreNotAtRest) {
  const std::string scene = R"json({{"q0": ["0.1"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["-9.81"],
      "contacts": [{{"name": "floor", "gap": "q[0]-0.1"}}, {{"name": "press", "gap": "0.1-q[0]{}"}}]}})json";
  for (const char* motion : {"-t*t", "-t*t*t"})  // in the second, accelerations are zero at first
    EXPECT_EQ(motion_of_scene(fmt::format(fmt::runtime(scene), motion)).grade, Grade::open);
  const auto opens = motion_of_scene(fmt::format(fmt::runtime(scene), "+t*t"));
  ASSERT_EQ(opens.grade, Grade::proven) << opens.reason;
  EXPECT_EQ(opens.modes, (std::vector<std::string>{"closed", "open"}));
}

/// On a platform that rises at 1 m/s, x flies to and fro between walls: zeros that contacts imply are not those of moving ones.
TEST(RedundantContacts, PlatformsThatRiseKeepTheirVelocity) {
  const auto motion = motion_of_scene(
      R"json({"q0": ["0", "0"], "v0": ["1", "1"], "T": "2.5", "M": [["1", "0"], ["0", "1"]], "f": ["0", "-9.81"],
          "contacts": [{"name": "platform", "gap": "q[1]-t"}, {"name": "wall", "gap": "1-q[0]", "e": "1"}]})json");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_NEAR(value_of(motion.q[1]), 2.5, 1e-25);
  EXPECT_NEAR(value_of(motion.v[1]), 1, 1e-25);
  EXPECT_NEAR(value_of(motion.q[0]), -0.5, 1e-25);
}

/// Two legs that slip, with a rod between them that touches neither: closed form of a block, x = x' t - mu g t^2 / 2.
TEST(RedundantContacts, SlipOfTwoLegsEndsAtOnce) {
  const auto motion = motion_of_scene(
      R"json({"q0": ["0", "0", "0"], "v0": ["1", "0", "0"], "T": "1", "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "0.1"]],
          "f": ["0", "-10", "0"],
          "contacts": [{"name": "left", "gap": "q[1]-0.3*sin(q[2])", "mu": "0.2", "Jt": [["1", "0", "0"]]},
                       {"name": "right", "gap": "q[1]+0.3*sin(q[2])", "mu": "0.2", "Jt": [["1", "0", "0"]]}]
})json");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.events.size(), 1u);
  EXPECT_NEAR(value_of(motion.events[0].time), 0.5, 1e-25);
  EXPECT_NEAR(value_of(motion.q[0]), 0.25, 1e-25);
  EXPECT_EQ(motion.modes, (std::vector<std::string>{"stick", "stick"}));
}

/// Painlevé's rod, whose tip may lift or press while it slips: (J_n + mu J_t)' M^-1 J_n < 0 and d2/dt2 gap > 0 without force.
TEST(RedundantContacts, DifferentMotionsAreNotOne) {
  const auto motion = motion_of_scene(
      R"json({"q0": ["0", "sin(1)", "1"], "v0": ["-20", "5*cos(1)", "5"], "T": "0.01",
              "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1/3"]], "f": ["0", "-9.81", "0"],
              "contacts": [{"name": "tip", "gap": "q[1]-sin(q[2])", "Jt": [["1", "0", "sin(q[2])"]], "mu": "2"}]})json");
  EXPECT_EQ(motion.grade, Grade::open);
  EXPECT_TRUE(motion.reason.find("2 alternatives proven") != std::string::npos) << motion.reason;
}

/// A stool on three legs that is pushed harder than friction holds must not be said to rest.
TEST(RedundantContacts, PushedStoolsDoNotRest) {
  const auto motion = motion_of_scene(
      R"json({"q0": ["0", "0", "0"], "v0": ["0", "0", "0"], "T": "1", "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "0.1"]],
          "f": ["6", "-9.81", "0"],
          "contacts": [{"name": "left", "gap": "q[1]-0.3*sin(q[2])", "mu": "0.5", "Jt": [["1", "0", "0"]]},
                       {"name": "middle", "gap": "q[1]", "mu": "0.5", "Jt": [["1", "0", "0"]]},
                       {"name": "right", "gap": "q[1]+0.3*sin(q[2])", "mu": "0.5", "Jt": [["1", "0", "0"]]}]
})json");
  const bool slides = motion.grade == Grade::proven && std::abs(value_of(motion.q[0]) - (6 - 4.905) / 2) < 1e-12;
  EXPECT_TRUE(motion.grade == Grade::open || slides) << motion.reason;
}

}  // namespace
}  // namespace ricochet::reference::certified
