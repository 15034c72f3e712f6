// What counts as zero at a contact must not depend on units, on bodies elsewhere, or on what an impact has just stopped.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve(const std::string& scene, const std::string& method, double tolerance = 1e-10) {
  const auto problem = read_scene_text(scene, "scene");
  Settings settings;
  settings.steps = 50;
  settings.tolerance = tolerance;
  settings.audit = true;
  return make_method(method)->solve(*problem, settings);
}

/// A scene of one mass that falls obliquely on the ground, in units of length and time, with a body elsewhere or not.
struct Drop {
  double length = 1, time = 1;
  bool has_decoy = false;
  double eps_r = 0, mu = 0.7;

  std::string text() const {
    const auto velocity = [&](double v) { return fmt::format("\"{:.17g}\"", v * length / time); };
    const auto number = [&](double x) { return fmt::format("\"{:.17g}\"", x * length); };
    const std::string weight = fmt::format("\"{:.17g}\"", -2 * 9.81 * length / (time * time));
    const std::string spring = fmt::format("\"-{:.17g}*(q[0]-{:.17g})\"", 3 / (time * time), 0.4 * length);
    const char* decoy_M = R"(, ["0", "0", "5"])";
    return fmt::format(
        R"({{"q0": [{}, {}{}], "v0": [{}, {}{}], "T": "{:.17g}", "M": [["2", "0"{}], ["0", "2"{}]{}],
             "f": [{}, {}{}], "contacts": [{{"name": "ground", "gap": "q[1]", "e": "{}", "mu": "{}",
             "Jt": [["1", "0"{}]]}}]}})",
        number(0.1), number(0.3), has_decoy ? ", \"7\"" : "", velocity(0.3), velocity(-0.5),
        has_decoy ? ", \"11\"" : "", 1.5 * time, has_decoy ? ", \"0\"" : "", has_decoy ? ", \"0\"" : "",
        has_decoy ? decoy_M : "", spring, weight, has_decoy ? ", \"1\"" : "", eps_r, mu, has_decoy ? ", \"0\"" : "");
  }
};

class OfADrop : public testing::TestWithParam<Drop> {};

/// The friction of the impact stops the block: its slip was compared with the velocity that was left, which is zero.
TEST_P(OfADrop, AreThoseOfWhatStopsIt) {
  for (const char* method : {"fesd_adaptive:radau-iia:4", "fesd:radau-iia:3,elements=as_needed"}) {
    const Solution plain = solve(GetParam().text(), method);
    ASSERT_TRUE(plain.succeeded()) << method << ": " << plain.message;
    EXPECT_LT(plain.max_residual(), 1e-12) << method << ": the accuracy of the stage equations";
    if (GetParam().eps_r == 0 && GetParam().mu > 0.5)
      EXPECT_NEAR(plain.v[0], 0, 1e-12) << method << ": it sticks where it landed";
  }
}

/// Fixed steps have no tolerance in SI units, so that scaled equations have the scaled solution.
TEST_P(OfADrop, ScaleWithTheUnits) {
  const Solution plain = solve(GetParam().text(), "fesd:radau-iia:3,elements=as_needed");
  ASSERT_TRUE(plain.succeeded()) << plain.message;
  for (const auto& [length, time] : {std::pair(1e6, 1.0), {1e-6, 1.0}, {1.0, 1e6}, {1.0, 1e-6}, {1e6, 1e-6}}) {
    Drop other = GetParam();
    other.length = length;
    other.time = time;
    const Solution scaled = solve(other.text(), "fesd:radau-iia:3,elements=as_needed");
    ASSERT_TRUE(scaled.succeeded()) << length << ", " << time << ": " << scaled.message;
    ASSERT_EQ(scaled.events.size(), plain.events.size());
    for (int k = 0; k < 2; ++k) {  // rounding of 50 steps
      EXPECT_NEAR(scaled.q[k] / length, plain.q[k], 1e-12);
      EXPECT_NEAR(scaled.v[k] * time / length, plain.v[k], 1e-11);
    }
  }
}

TEST_P(OfADrop, KnowNothingOfABodyElsewhere) {
  Drop with_decoy = GetParam();
  with_decoy.has_decoy = true;
  for (const char* method : {"fesd_adaptive:radau-iia:4", "fesd:radau-iia:3,elements=as_needed"}) {
    const Solution plain = solve(GetParam().text(), method), beside = solve(with_decoy.text(), method);
    ASSERT_TRUE(beside.succeeded()) << method << ": " << beside.message;
    ASSERT_EQ(beside.events.size(), plain.events.size()) << method;
    for (int k = 0; k < 2; ++k) {  // steps may differ, by what a tolerance of 1e-10 leaves
      EXPECT_NEAR(beside.q[k], plain.q[k], 1e-9) << method;
      EXPECT_NEAR(beside.v[k], plain.v[k], 1e-9) << method;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, OfADrop,
                         testing::Values(Drop{.eps_r = 0, .mu = 0.7}, Drop{.eps_r = 0, .mu = 0.05},
                                         Drop{.eps_r = 0.5, .mu = 0.3}, Drop{.eps_r = 0, .mu = 1.5}));

/// At rest from the beginning, also where q = 0, v = 0 and only the load has a size.
TEST(ContactScales, LeaveABodyAtRest) {
  for (const char* units : {"1", "1e-6", "1e6"}) {
    for (const char* eps_r : {"0", "0.5", "1"}) {
      const std::string scene = fmt::format(
          R"({{"params": {{"u": "{}"}}, "q0": ["0", "0"], "v0": ["0", "0"], "T": "2", "M": [["1", "0"], ["0", "1"]],
               "f": ["0.2*u", "-9.81*u"],
               "contacts": [{{"name": "ground", "gap": "q[1]", "e": "{}", "mu": "0.3", "Jt": [["1", "0"]]}}]}})",
          units, eps_r);
      for (const char* method : {"fesd_adaptive:radau-iia:4", "fesd:radau-iia:3"}) {
        const Solution rest = solve(scene, method);
        ASSERT_TRUE(rest.succeeded()) << method << ": " << rest.message;
        EXPECT_TRUE(rest.events.empty()) << method;
        EXPECT_LT(rest.q.cwiseAbs().maxCoeff(), 1e-15 * std::stod(units)) << method << ": rounding of g T^2";
      }
    }
  }
}

/// Slip in space that begins from a velocity of rounding begins where the force points, whatever its sign.
TEST(ContactScales, TakeAVelocityOfRoundingForNone) {
  Vector q, v;
  for (const char* v_0 : {"0", "1e-17", "-1e-17", "-3e-16"}) {
    const std::string scene = fmt::format(
        R"({{"q0": ["0", "0", "0"], "v0": ["{}", "0", "0"], "T": "0.5",
             "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]], "f": ["4", "1", "-9.81"],
             "contacts": [{{"name": "ground", "gap": "q[2]", "mu": "0.3",
                            "Jt": [["1", "0", "0"], ["0", "1", "0"]]}}]}})",
        v_0);
    const Solution slides = solve(scene, "fesd_adaptive:radau-iia:4");
    ASSERT_TRUE(slides.succeeded()) << "v_0 = " << v_0 << ": " << slides.message;
    const double a = std::hypot(4, 1) - 0.3 * 9.81;  // along the force
    EXPECT_NEAR(slides.v[0], 0.5 * a * 4 / std::hypot(4, 1), 1e-13) << "constant acceleration is solved to rounding";
    EXPECT_NEAR(slides.v[1], 0.5 * a / std::hypot(4, 1), 1e-13);
  }
}

/// Five pendulums that touch: their gaps are zero without a size of their own, and after the impact their forces are
/// rounding. They go on together, since Newton's law is imposed on all contacts at once.
TEST(ContactScales, KeepACradleTogether) {
  for (const char* eps_r : {"1", "0.9", "0.5"}) {
    std::string M, f, contacts;
    for (int k = 0; k < 5; ++k) {
      M += fmt::format("{}[\"{}\", \"{}\", \"{}\", \"{}\", \"{}\"]", k ? ", " : "", int(k == 0), int(k == 1),
                       int(k == 2), int(k == 3), int(k == 4));
      f += fmt::format("{}\"-9.81*sin(q[{}])\"", k ? ", " : "", k);
      if (k < 4)
        contacts += fmt::format(
            R"({}{{"name": "c{}", "gap": "sqrt((0.1+sin(q[{}])-sin(q[{}]))**2+(cos(q[{}])-cos(q[{}]))**2)-0.1", "e": "{}"}})",
            k ? ", " : "", k, k + 1, k, k + 1, k, eps_r);
    }
    const std::string scene = fmt::format(
        R"({{"q0": ["-0.5", "0", "0", "0", "0"], "v0": ["0", "0", "0", "0", "0"], "T": "3", "M": [{}], "f": [{}],
             "contacts": [{}]}})",
        M, f, contacts);
    const Solution adaptive = solve(scene, "fesd_adaptive:radau-iia:4"),
                   fixed = solve(scene, "fesd:radau-iia:4,elements=as_needed");
    ASSERT_TRUE(adaptive.succeeded()) << eps_r << ": " << adaptive.message;
    ASSERT_TRUE(fixed.succeeded()) << eps_r << ": " << fixed.message;
    for (int k = 0; k < 5; ++k) EXPECT_NEAR(adaptive.q[k], fixed.q[k], 1e-7) << "50 steps of order 7 leave 2e-8";
    for (int k = 2; k < 5; ++k) EXPECT_NEAR(adaptive.q[k], adaptive.q[1], 1e-10) << "they swing as one";
  }
}

/// A contact whose own switch ends the element, at an instant when an impact strikes its bodies: what it does after the
/// impact follows from the velocity there.
TEST(ContactScales, LetAnImpactDecideAtASwitch) {
  // A block slides to rest under a ball that lands on its slope at this very instant: slip stops at t = v / (mu g).
  const std::string scene = R"({
    "params": {"mu": "0.5", "g": "8"},
    "q0": ["0", "0", "10"], "v0": ["1", "0", "-4"], "T": "0.4",
    "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]], "f": ["0", "-g", "0"],
    "contacts": [{"name": "ground", "gap": "q[1]", "mu": "mu", "Jt": [["1", "0", "0"]]},
                 {"name": "side", "gap": "q[2]-q[0]-9+0.125", "e": "0"}]})";
  const Solution solution = solve(scene, "fesd_adaptive:radau-iia:4");
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  // Both move on with half of the other body's 4 m/s, and the ground brakes the block's half of the weight.
  EXPECT_NEAR(solution.v[0], -2 + 0.5 * 8 / 2 * 0.15, 1e-9);
  EXPECT_NEAR(solution.v[2], solution.v[0], 1e-9);
}

}  // namespace
}  // namespace ricochet
