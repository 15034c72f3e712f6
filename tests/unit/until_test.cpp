// Runs that end where a formula vanishes: in closed form, with every method.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "reference/proven.h"

namespace ricochet {
namespace {

/// A ball that falls from 1 m, with e = 0.5, on the ground.
std::string ball(const std::string& until, double T = 3) {
  return fmt::format(R"json({{"params": {{"g": "10"}}, "q0": ["1"], "v0": ["0"], "T": {}, "M": [[1]], "f": ["-g"],
      "contacts": [{{"name": "ground", "gap": "q[0]", "e": 0.5}}], "until": "{}"}})json",
                     T, until);
}

struct Ended {
  std::string name, until;
  double t, q, v;
};

/// The ball hits the ground at sqrt(0.2) s with sqrt(20) m/s, and rises with half of it to 0.25 m.
std::vector<Ended> ends() {
  const double fall = std::sqrt(0.2), up = std::sqrt(5.0);
  return {
      {"height", "q[0] - 0.3", std::sqrt(0.14), 0.3, -std::sqrt(14.0)},
      {"time", "t - 0.3", 0.3, 0.55, -3},
      {"energy", "10*q[0] + v[0]**2/2 - 5", fall, 0, up},  // an impact takes it from 10 J to 2.5 J
      {"kink", "abs(q[0] - 0.6) - 0.2", std::sqrt(0.04), 0.8, -2},
  };
}

TEST(Until, TheEndOfTheRunIsLocated) {
  for (const char* method : {"event_driven", "event_driven:radau-iia:5", "fesd_adaptive:radau-iia:4", "cvode", "arkode",
                             "ida", "fesd:radau-iia:3", "extrapolated_moreau"}) {
    const auto m = make_method(method);
    Settings settings;
    settings.tolerance = 1e-10;
    settings.steps = 50;
    for (const Ended& c : ends()) {
      const auto problem = read_scene_text(ball(c.until), "scene");
      const Solution s = m->solve(*problem, settings);
      ASSERT_TRUE(s.succeeded()) << method << ' ' << c.name << ": " << s.message;
      const double accuracy = std::string(method) == "extrapolated_moreau" ? 1e-5 : 1e-7;  // of its switches
      EXPECT_NEAR(s.t, c.t, accuracy) << method << ' ' << c.name;
      EXPECT_NEAR(s.q[0], c.q, accuracy) << method << ' ' << c.name;
      EXPECT_NEAR(s.v[0], c.v, 10 * accuracy) << method << ' ' << c.name;
    }
  }
}

TEST(Until, AnImpactThatChangesTheSignEndsTheRun) {  // v jumps from -sqrt(20) to sqrt(5) m/s
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4", "cvode", "fesd:radau-iia:3"}) {
    const auto m = make_method(method);
    Settings settings;
    settings.tolerance = 1e-10;
    settings.steps = 50;
    const auto problem = read_scene_text(ball("v[0] - 0.1"), "scene");
    const Solution s = m->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.t, std::sqrt(0.2), 1e-8) << method;
    EXPECT_NEAR(s.v[0], std::sqrt(5.0), 1e-7) << method;
    ASSERT_FALSE(s.events.empty());
    EXPECT_EQ(s.events.back().kind, EventKind::impact) << method;
  }
}

TEST(Until, AZeroAtTheStartIsNone) {  // back at the start after the time 2 v / g
  const std::string scene = R"json({"q0": ["1"], "v0": ["2"], "T": 3, "M": [[1]], "f": ["-10"],
      "contacts": [{"name": "ground", "gap": "q[0]", "e": 0.5}], "until": "q[0] - 1"})json";
  for (const char* method :
       {"event_driven", "fesd_adaptive:radau-iia:4", "cvode", "fesd:radau-iia:3", "moreau_jean", "irk:gauss:2"}) {
    const auto m = make_method(method);
    const auto problem = read_scene_text(scene, "scene");
    if (!m->can_run(problem->info()).ok) continue;
    Settings settings;
    settings.tolerance = 1e-10;
    settings.steps = 400;
    const Solution s = m->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.t, 0.4, std::string(method) == "moreau_jean" ? 0.01 : 1e-8) << method;  // order 1
  }
}

TEST(Until, IsNotReachedByShorterRuns) {
  const auto problem = read_scene_text(ball("q[0] - 0.3", 0.2), "scene");
  for (const char* method : {"event_driven", "cvode", "moreau_jean"}) {
    Settings settings;
    settings.tolerance = 1e-8;
    settings.steps = 10;
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_DOUBLE_EQ(s.t, 0.2) << method;
  }
}

/// Every method that can run it ends a pendulum at the bottom, with its own order.
TEST(Until, EveryMethodEndsThere) {
  const std::string scene = R"json({"q0": ["1"], "v0": ["0"], "T": 1, "M": [[1]], "f": ["-9*q[0]"],
      "contacts": [{"name": "far", "gap": "q[0]+10", "e": 0.5}], "until": "q[0]"})json";
  const auto problem = read_scene_text(scene, "scene");
  int ran = 0;
  std::vector<std::string> names;
  for (const MethodEntry& entry : methods()) names.insert(names.end(), entry.examples.begin(), entry.examples.end());
  for (const std::string& name : names) {
    const auto m = make_method(name);
    if (!m->can_run(problem->info()).ok) continue;
    Settings settings;
    settings.tolerance = 1e-6;
    settings.steps = 200;
    settings.time_limit = 20;
    const Solution s = m->solve(*problem, settings);
    if (!s.succeeded()) continue;  // its own reasons, as on any scene
    ++ran;
    EXPECT_NEAR(s.t, std::numbers::pi / 6, 0.02) << name;  // order 1 at 200 steps of 5 ms
    EXPECT_NEAR(s.q[0], 0, 1e-9) << name;
    EXPECT_NEAR(s.v[0], -3, 0.1) << name;
    EXPECT_LT(s.t, 0.9) << name;
  }
  EXPECT_GT(ran, 15);
}

TEST(Until, TheEndHasTheOrderOfTheMethod) {  // of q = cos(3 t): also where the grid does not meet it
  const std::string scene =
      R"json({"q0": ["1"], "v0": ["0"], "T": 1, "M": [[1]], "f": ["-9*sin(q[0])"], "until": "q[0]-0.2"})json";
  const auto problem = read_scene_text(scene, "scene");
  const reference::Reference truth = reference::truth_of(*problem);
  for (const auto& [method, order] : {std::pair{"irk:gauss:2", 4},
                                      {"irk:radau-iia:2", 3},
                                      {"fesd:radau-iia:2", 3},
                                      {"fesd:gauss:2", 4},
                                      {"symplectic", 2}}) {
    const auto m = make_method(method);
    Settings settings;
    settings.steps = 20;
    const double coarse = truth.error_of(m->solve(*problem, settings));
    settings.steps = 80;  // the last step differs in length from run to run
    const double fine = truth.error_of(m->solve(*problem, settings));
    EXPECT_GT(std::log2(coarse / fine) / 2, order - 0.6) << method << ": " << coarse << ' ' << fine;
  }
}

TEST(Until, ProofsEndThere) {
  for (const Ended& c : ends()) {
    const auto problem = read_scene_text(ball(c.until), "scene");
    const auto truth = reference::proven_reference(*problem);
    ASSERT_TRUE(truth) << c.name;
    EXPECT_TRUE(truth->is_truth) << c.name << truth->how;
    EXPECT_NEAR(truth->solution.t, c.t, 1e-15) << c.name;
    EXPECT_NEAR(truth->solution.q[0], c.q, 1e-15) << c.name;
    EXPECT_NEAR(truth->solution.v[0], c.v, 4e-15) << c.name;
  }
}

TEST(Until, DerivativesAreThoseOfTheEnd) {  // v = -sqrt(v0^2 + 2 g (q0 - 0.3)), t = (v0 - v) / g
  const std::string scene = R"json({"params": {"g": "10"}, "q0": ["1"], "v0": ["2"], "T": 3, "M": [[1]], "f": ["-g"],
      "contacts": [{"name": "ground", "gap": "q[0]", "e": 0.5}], "until": "q[0]-0.3"})json";
  const auto problem = read_scene_text(scene, "scene");
  const double v = -std::sqrt(4 + 20 * 0.7);
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4"}) {
    Settings settings;
    settings.tolerance = 1e-12;
    settings.sensitivities = {"q0:0", "v0:0", "param:g"};
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(s.v[0], v, 1e-10);
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(s.dq(0, j), 0, 1e-9) << method << j;
    EXPECT_NEAR(s.dv(0, 0), 10 / v, 1e-9) << method;
    EXPECT_NEAR(s.dv(0, 1), 2 / v, 1e-9) << method;
    EXPECT_NEAR(s.dv(0, 2), 0.7 / v, 1e-9) << method;
  }
}

TEST(Until, TheMotionEndsThere) {
  const auto problem = read_scene_text(ball("q[0] - 0.3"), "scene");
  for (const char* method : {"event_driven", "moreau_jean", "cvode", "fesd:radau-iia:2"}) {
    Settings settings;
    settings.tolerance = 1e-8;
    settings.steps = 100;
    settings.recording = Recording::motion;
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(s.motion.end(), s.t, 1e-12) << method;
    for (const Event& event : s.events) EXPECT_LE(event.t, s.t) << method;
  }
}

TEST(Until, AFormulaOfTheProgramsProblems) {
  const auto problem = with_until(*read_scene_text(ball("q[0] - 0.3"), "scene"), "q[0] - g/20");
  Settings settings;
  settings.tolerance = 1e-10;
  EXPECT_NEAR(make_method("event_driven")->solve(*problem, settings).q[0], 0.5, 1e-10);
}

TEST(Until, AConstantIsRejected) {
  EXPECT_THROW(read_scene_text(ball("g - 3"), "scene"), InputError);
  EXPECT_THROW(read_scene_text(ball("q[1]"), "scene"), InputError);
}

}  // namespace
}  // namespace ricochet
