// Proofs of assembled scenes, whose formulas are those of their parts, and of parts that move independently.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "reference/certified/mode_motion.h"
#include "tests/reference/decimal_balls.h"

namespace ricochet::reference::certified {
namespace {

constexpr slong kClosedFormBits = 400;
const Precision kWide{kClosedFormBits, 1};

/// Numbers with 400 bits, for closed forms.
struct Exact {
  Ball ball;
  Exact(const char* text) { arb_set_str(ball.get(), text, kClosedFormBits); }
  Exact(int number) : ball(static_cast<double>(number)) {}
  Exact(Ball b) : ball(std::move(b)) {}
};
Exact operator+(const Exact& a, const Exact& b) {
  return kWide.add(a.ball, b.ball);
}
Exact operator-(const Exact& a, const Exact& b) {
  return kWide.sub(a.ball, b.ball);
}
Exact operator*(const Exact& a, const Exact& b) {
  return kWide.mul(a.ball, b.ball);
}
Exact operator/(const Exact& a, const Exact& b) {
  return kWide.div(a.ball, b.ball);
}
Exact root(const Exact& a) {
  Ball result;
  arb_sqrt(result.get(), a.ball.get(), kClosedFormBits);
  return result;
}

void expect_is(const CertifiedNumber& number, const Exact& exact, const std::string& what) {
  EXPECT_TRUE(arb_overlaps(interval(number).get(), exact.ball.get())) << what << " = " << number.text;
}

/// Two proofs of one number contain it both.
void expect_agree(const CertifiedNumber& a, const CertifiedNumber& b, const std::string& what) {
  EXPECT_TRUE(arb_overlaps(interval(a).get(), interval(b).get())) << what << ": " << a.text << ", " << b.text;
}

CertifiedMotion proven(const std::string& id, const ParameterChanges& changes = {}) {
  CertifiedMotion motion = certified_motion(*make_problem(id, changes));
  EXPECT_EQ(motion.grade, Grade::proven) << id << ": " << motion.reason;
  EXPECT_GE(motion.decimals(), 30) << id;
  return motion;
}

CertifiedMotion motion_of_text(const std::string& scene, double seconds = 10) {
  return certified_motion(*read_scene_text(scene, "scene"), {.max_seconds = seconds});
}

/// Bead i falls the distance d + i s with the speed 1 m/s at first, and stops.
TEST(CertifiedAssembled, BeadsStopAtTheWall) {
  const auto motion = proven("bead_row");
  ASSERT_EQ(motion.events.size(), 8u);
  for (int i = 0; i < 8; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Exact way = Exact("0.05") + Exact(i) * Exact("0.001"), g = "9.81";
    expect_is(motion.events[k].time, (root(Exact(1) + Exact(2) * g * way) - Exact(1)) / g, "time of an impact");
    expect_is(motion.q[k], Exact("0.05") + Exact(i) * Exact("0.1"), "x");
    expect_is(motion.v[k], Exact(0), "v");
  }
}

/// Block i of n brakes by mu g, friction above and below together, until it has lost its speed i speed / n.
TEST(CertifiedAssembled, BlocksStopOneAfterTheOther) {
  for (const int n : {2, 3}) {
    const auto motion = proven("block_column", {{"n", n}, {"duration", 0.25}});
    ASSERT_EQ(std::ssize(motion.events), n);
    for (int i = 0; i < n; ++i) {
      const Exact v = Exact(i + 1) / Exact(n), a = Exact("0.5") * Exact("9.81");
      expect_is(motion.events[static_cast<std::size_t>(i)].time, v / a, "time of a stop");
      expect_is(motion.q[static_cast<std::size_t>(2 * i)], v * v / (Exact(2) * a), "x");
      expect_is(motion.q[static_cast<std::size_t>(2 * i + 1)], Exact("0.05") + Exact(i) * Exact("0.1"), "y");
    }
  }
}

TEST(CertifiedAssembled, OneBallFallsBesideOthersThatLie) {
  const auto motion = proven("separate_balls");
  ASSERT_EQ(motion.events.size(), 1u);
  const Exact g = "9.81", t = root(Exact("0.4") / g), rest = Exact("0.25") - t, v = g * t / Exact(2);
  expect_is(motion.events[0].time, t, "time of the impact");
  expect_is(motion.q[0], Exact("0.05") + v * rest - g * rest * rest / Exact(2), "z");
  expect_is(motion.v[0], v - g * rest, "v");
}

/// Both hit the rough ground at the same time, and stay: 12 coordinates, 3 contacts with friction in space.
TEST(CertifiedAssembled, SpheresOfAPileHitTheGroundAtOnce) {
  const auto motion = proven("sphere_pile");
  ASSERT_EQ(motion.events.size(), 2u);
  const Exact t = root(Exact("0.04") / Exact("9.81"));
  for (const auto& event : motion.events) {
    EXPECT_EQ(event.kind, "impact");
    EXPECT_EQ(event.modes, (std::vector<std::string>{"stick", "stick", "open"}));
    expect_is(event.time, t, "time of the impacts");
  }
  for (const std::size_t sphere : {0u, 6u}) {
    expect_is(motion.q[sphere + 2], Exact("0.05"), "z");
    for (std::size_t k = 0; k < 6; ++k) expect_is(motion.v[sphere + k], Exact(0), "v");
  }
}

/// Their numbers are decimals, not sums of doubles: six blocks of 0.1 m touch.
TEST(CertifiedAssembled, BlocksTouchExactly) {
  const auto problem = make_problem("block_column", {{"n", 6}, {"duration", 0.05}});
  const auto motion = certified_motion(*problem, {.digits = 20});
  EXPECT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_TRUE(motion.assumptions.empty());
}

TEST(CertifiedAssembled, StartFromAStateThatWasSet) {
  const auto problem = make_problem("bead_row", {{"n", 2}, {"duration", 0.01}});
  Vector v0 = problem->info().v0;
  v0[1] = -0.75;
  problem->set_initial_state(problem->info().q0, v0);
  const auto motion = certified_motion(*problem);
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  const Exact fall = Exact("9.81") / Exact(20000);
  expect_is(motion.q[0], Exact("0.1") - Exact("0.01") - fall, "x of the bead that keeps its speed");
  expect_is(motion.q[1], Exact("0.201") - Exact("0.0075") - fall, "x of the other one");
}

TEST(CertifiedAssembled, ReasonsOfOpenMotions) {
  EXPECT_EQ(certified_motion(*make_problem("newtons_cradle")).reason, "impact law lzb");
  const std::string redundant = certified_motion(*make_problem("block_on_feet")).reason;
  EXPECT_EQ(redundant.substr(0, 7), "modes: ") << redundant;
  const std::string many = certified_motion(*make_problem("bead_row", {{"n", 1000}})).reason;
  EXPECT_EQ(many, "1000 coordinates and 1000 contacts are too many") << many;
}

/// 20 balls that lie there have 2^20 combinations of modes together, and two each alone.
TEST(IndependentParts, AreDecidedOneAfterTheOther) {
  const auto motion = proven("separate_balls", {{"n", 21}});
  EXPECT_EQ(motion.events.size(), 1u);
}

std::string two_balls(const std::string& mass, const std::string& force, const std::string& second_tangent = "1") {
  return fmt::format(
      R"({{"q0": ["0", "0", "3", "0"], "v0": ["1", "0", "1", "0"], "T": "0.01",
          "M": [["1", "0", "0", "0"], ["0", "1", "0", "{0}"], ["0", "0", "1", "0"], ["0", "{0}", "0", "1"]],
          "f": ["0", "-9.81", "{1}", "-9.81"],
          "contacts": [{{"name": "first", "gap": "q[1]", "mu": "0.1", "Jt": [["1", "0", "0", "0"]]}},
                       {{"name": "second", "gap": "q[3]", "mu": "0.1", "Jt": [["0", "0", "{2}", "0"]]}}]}})",
      mass, force, second_tangent);
}

TEST(IndependentParts, ShareNoMomentumAndNoVariable) {
  const auto parts = [](const std::string& scene, const std::vector<int>& contacts) {
    const auto problem = read_scene_text(scene, "scene");
    SeriesProgram program({100, 4});
    return independent_parts(scene_formulas(*problem, Reading::decimal, program), contacts, program);
  };
  using Parts = std::vector<std::vector<int>>;
  EXPECT_EQ(parts(two_balls("0", "0"), {0, 1}), (Parts{{0}, {1}}));
  EXPECT_EQ(parts(two_balls("0", "-q[2]*t"), {1, 0}), (Parts{{0}, {1}})) << "a force of its own";
  EXPECT_EQ(parts(two_balls("0.5", "0"), {0, 1}), (Parts{{0, 1}})) << "joined by M";
  EXPECT_EQ(parts(two_balls("0", "-q[0]"), {0, 1}), (Parts{{0, 1}})) << "joined by a spring";
  EXPECT_EQ(parts(two_balls("0", "-v[1]"), {0, 1}), (Parts{{0, 1}})) << "joined by a damper";
  EXPECT_EQ(parts(two_balls("0", "0", "1+q[0]**2"), {0, 1}), (Parts{{0, 1}})) << "joined by a tangent";
}

/// The contact of a block with the rough floor, without restitution; its first coordinate is horizontal.
std::string block(const std::string& name, const std::string& mu, int first, int n) {
  const auto unit = [&](int k) {
    std::string row;
    for (int c = 0; c < n; ++c) row += fmt::format("{}\"{}\"", c ? ", " : "", c == k ? 1 : 0);
    return row;
  };
  return fmt::format(R"({{"name": "floor {}", "gap": "q[{}]", "mu": "{}", "Jt": [[{}]]}})", name, first + 1, mu,
                     unit(first));
}

std::string falling_blocks(const std::vector<std::string>& speeds, const std::vector<std::string>& mu,
                           const std::string& more_force = "") {
  const int n = 2 * static_cast<int>(speeds.size());
  std::string q0, v0, M, f, contacts;
  for (int k = 0; k < n; ++k) {
    const auto body = static_cast<std::size_t>(k / 2);
    const char* comma = k ? ", " : "";
    q0 += fmt::format("{}\"{}\"", comma, k % 2 ? "0.3" : "0");
    v0 += fmt::format("{}\"{}\"", comma, k % 2 ? "0" : speeds[body]);
    f += fmt::format("{}\"{}{}\"", comma, k % 2 ? "-9.81" : "0", more_force);
    M += comma + std::string("[");
    for (int c = 0; c < n; ++c) M += fmt::format("{}\"{}\"", c ? ", " : "", c == k ? 1 : 0);
    M += "]";
    if (k % 2 == 0) contacts += comma + block(std::to_string(body), mu[body], k, n);
  }
  return fmt::format(R"({{"q0": [{}], "v0": [{}], "T": "0.5", "M": [{}], "f": [{}], "contacts": [{}]}})", q0, v0, M, f,
                     contacts);
}

/// One block sticks in the impact, another one slips and stops later, the third slips to the end. Together they move as
/// each of them alone.
TEST(SimultaneousImpacts, CloseContactsWithoutRestitution) {
  const std::vector<std::string> speeds{"0.2", "1", "-3"}, mu{"0.4", "0.35", "0.1"};
  const auto together = motion_of_text(falling_blocks(speeds, mu));
  ASSERT_EQ(together.grade, Grade::proven) << together.reason;
  EXPECT_EQ(together.modes, (std::vector<std::string>{"stick", "stick", "slip-"}));
  ASSERT_EQ(together.events.size(), 4u);
  const Exact t = root(Exact("0.6") / Exact("9.81"));
  for (std::size_t k = 0; k < 3; ++k) expect_is(together.events[k].time, t, "time of the impacts");
  EXPECT_EQ(together.events[2].modes, (std::vector<std::string>{"stick", "slip+", "slip-"}));
  for (std::size_t k = 0; k < 3; ++k) {
    const auto alone = motion_of_text(falling_blocks({speeds[k]}, {mu[k]}));
    ASSERT_EQ(alone.grade, Grade::proven) << alone.reason;
    for (std::size_t c = 0; c < 2; ++c) {
      expect_agree(alone.q[c], together.q[2 * k + c], "q");
      expect_agree(alone.v[c], together.v[2 * k + c], "v");
    }
    if (k == 1) expect_agree(alone.events[1].time, together.events[3].time, "time of the stop");
  }
}

/// A force between the blocks lets the modes of one depend on those of the other: their order is not indifferent.
TEST(SimultaneousImpacts, OfDependentPartsStayOpen) {
  const auto motion = motion_of_text(falling_blocks({"0.2", "1"}, {"0.4", "0.35"}, "-0.01*q[0]-0.01*q[2]"));
  EXPECT_EQ(motion.grade, Grade::open);
  EXPECT_TRUE(motion.reason.find("at the same time") != std::string::npos) << motion.reason;
}

}  // namespace
}  // namespace ricochet::reference::certified
