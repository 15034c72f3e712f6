// Formulas that bend or jump: regions, borders between them, and motions in closed form through these.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "problems/variables.h"

namespace ricochet {
namespace {

/// A mass of 1 kg on a line, under a force, with a contact that is far away, or another one.
std::string mass(const std::string& force, double q0, double v0, double T,
                 const std::string& contact = R"({"name": "far", "gap": "q[0]+1000", "e": 0.5})",
                 const std::string& params = "") {
  return fmt::format(
      R"({{"params": {{{}}}, "q0": ["{}"], "v0": ["{}"], "T": {}, "M": [[1]], "f": ["{}"], "contacts": [{}]}})", params,
      q0, v0, T, force, contact);
}

Solution run(const std::string& scene, const std::string& method, double accuracy, Settings settings = {}) {
  const auto problem = read_scene_text(scene, "scene");
  const auto m = make_method(method);
  (m->info().is_adaptive ? settings.tolerance : settings.inner_tolerance) = m->info().is_adaptive ? accuracy : 1e-13;
  settings.steps = static_cast<int>(accuracy < 1 ? 100 : accuracy);
  return m->solve(*problem, settings);
}

// --- Switching functions --------------------------------------------------------------------------------------------

TEST(Regions, SharedArgumentsGiveOneFunction) {
  const auto problem = read_scene_text(mass("abs(q[0])+sign(-2*q[0])+if(3*q[0]<0,1,2)+max(t-1,0)", 1, 0, 1), "scene");
  const auto& switches = problem->info().switches;
  ASSERT_EQ(switches.size(), 2U);  // q and t - 1
  EXPECT_EQ(std::ranges::count_if(switches, &SwitchInfo::is_of_time), 1);
}

TEST(Regions, ArgumentsWithDecimalsAreFound) {
  for (const char* force : {"max(0,0.3*(q[0]-0.5))", "abs(0.1*(q[0]-0.7*v[0]))", "min(0.7*q[0]-0.1, 0.3*(q[0]+0.2))",
                            "sign(0.3-0.1*q[0])+abs(0.1*q[0]-0.3)", "if(0.2*q[0]<1.1*v[0]**2,1,2)"})
    EXPECT_FALSE(read_scene_text(mass(force, 1, 0, 1), "scene")->info().switches.empty()) << force;
}

TEST(Regions, SmoothScenesHaveNone) {
  EXPECT_TRUE(read_scene_text(mass("-sin(q[0])", 1, 0, 1), "scene")->info().switches.empty());
  const std::string with_parameter =
      mass("-abs(k)*q[0]", 1, 0, 1, R"({"name": "far", "gap": "q[0]+10", "e": 0.5})", R"("k": "-2")");
  EXPECT_TRUE(read_scene_text(with_parameter, "scene")->info().switches.empty());  // a number, not a branch
}

TEST(Regions, FormulasOfARegionHoldOnBothSides) {
  const auto problem = read_scene_text(mass("-3*max(q[0],0)-2*min(q[0],0)", 1, 0, 1), "scene");
  for (const int sign : {1, -1}) {
    const std::vector<int> signs{sign};
    const auto region = problem->in_region(signs);
    ASSERT_TRUE(region);
    EXPECT_TRUE(region->info().switches.empty());
    EXPECT_TRUE(region->info().structure.constant_force_jacobian);
    for (const double q : {-2.0, 2.0}) {
      const Vector f = region->force(Vector::Constant(1, q), Vector::Zero(1));
      double psi = 0;
      const double v = 0;
      region->switching(&q, &v, &psi);
      ASSERT_DOUBLE_EQ(std::abs(psi), std::abs(q));
      EXPECT_DOUBLE_EQ(f[0], (sign * psi * q > 0 ? -3 : -2) * q);
    }
  }
}

TEST(Regions, HaveTheImpactLawThatWasSet) {
  const auto problem = read_scene_text(mass("abs(q[0])", 1, 0, 1), "scene");
  problem->set_impact_law({.hypothesis = ImpactHypothesis::poisson, .stiffness = {}});
  const std::vector<int> signs{1};
  EXPECT_EQ(problem->in_region(signs)->info().impact_law.hypothesis, ImpactHypothesis::poisson);
}

TEST(Regions, InnerBranchesBelongToTheirRegion) {
  const auto problem = read_scene_text(mass("max(abs(q[0])-1,0)", 2, 0, 1), "scene");
  ASSERT_EQ(problem->info().switches.size(), 2U);
  const std::vector<int> signs{-1, 1};  // q < 0, -q - 1 > 0
  const Vector f = problem->in_region(signs)->force(Vector::Constant(1, -4.0), Vector::Zero(1));
  EXPECT_DOUBLE_EQ(f[0], 3);
}

// --- Motions in closed form -----------------------------------------------------------------------------------------

struct BranchedMotion {
  std::string name, scene;
  double q, v;
};

/// Two springs: q = cos(10 t) until q = 0, then with w_2 = sqrt(20) until q = 0 again, and so on.
std::pair<double, double> two_stiffnesses(double T) {
  const double w1 = 10, w2 = std::sqrt(20.0), speed = 10;
  double t = T - std::numbers::pi / 2 / w1;  // from q = 0 downwards
  for (;;) {
    if (t <= std::numbers::pi / w2) return {-speed / w2 * std::sin(w2 * t), -speed * std::cos(w2 * t)};
    t -= std::numbers::pi / w2;
    if (t <= std::numbers::pi / w1) return {speed / w1 * std::sin(w1 * t), speed * std::cos(w1 * t)};
    t -= std::numbers::pi / w1;
  }
}

std::vector<BranchedMotion> branched_motions() {
  const auto [q2, v2] = two_stiffnesses(3);
  return {
      {"jump_in_time", mass("if(t < 0.437, 1, -1)", 0, 0, 1), 0.183031, -0.126},
      {"jump_in_position", mass("if(q[0] < 0.5, 0, 2)", 0, 1, 1), 1.25, 2},
      {"two_stiffnesses", mass("-100*max(q[0],0)-20*min(q[0],0)", 1, 0, 3), q2, v2},
      // v = tan(arctan(3) - t) until the apex, then -tanh
      {"drag_at_apex", mass("-1-v[0]*abs(v[0])", 0, 3, 2),
       -std::log(std::cos(std::atan(3.0))) - std::log(std::cosh(2 - std::atan(3.0))), -std::tanh(2 - std::atan(3.0))},
      // a pulse of 1 ms in 20 s, and a wall
      {"short_pulse",
       mass("if(t < 10, 0, if(t < 10.001, 5000, 0))", 0, 0, 20, R"({"name": "wall", "gap": "30-q[0]", "e": 0.5})"),
       30 - 2.5 * (20 - (10.0005 + 6)), -2.5},
      // of time, three periods
      {"square_wave", mass("sign(sin(2*pi*t))", 0, 0, 3), 0.75, 0},
  };
}

class Motions : public testing::TestWithParam<std::string> {};

TEST_P(Motions, AreExactToTheTolerance) {
  for (const BranchedMotion& c : branched_motions()) {
    for (const double tolerance : {1e-6, 1e-10}) {
      const Solution s = run(c.scene, GetParam(), tolerance);
      ASSERT_TRUE(s.succeeded()) << c.name << ": " << s.message;
      const double size = 1 + std::abs(c.q) + std::abs(c.v);
      const double factor = GetParam().starts_with("cvode") ? 1e4 : 100;  // of errors per step to that of the end
      EXPECT_NEAR(s.q[0], c.q, factor * tolerance * size) << c.name << " at " << tolerance;
      EXPECT_NEAR(s.v[0], c.v, factor * tolerance * size) << c.name << " at " << tolerance;
    }
  }
}

/// A ball with e = 0.5, that falls from 0.5 m with the acceleration `down` and rises with `up`: from height h the next
/// height is h e^2 down / up. @returns q, v at T
std::pair<double, double> bouncing(double down, double up, double T) {
  for (double height = 0.5, t = 0; height > 1e-20;) {
    const double falls = std::sqrt(2 * height / down), left = T - t;
    if (left <= falls) return {height - down * left * left / 2, -down * left};
    t += falls;
    const double speed = 0.5 * down * falls, rises = speed / up, now = T - t;
    if (now <= rises) return {speed * now - up * now * now / 2, speed - up * now};
    t += rises;
    height = speed * rises / 2;
  }
  return {0, 0};
}

TEST_P(Motions, ImpactsChangeTheBranch) {  // as friction does, and as a motor does that drives upwards
  if (GetParam().find("gauss") != std::string::npos) GTEST_SKIP() << "it closes no accumulation of impacts";
  for (const auto& [up, down] : {std::pair{3.0, 1.0}, {1.0, 3.0}}) {
    for (const double T : {1.3, 2.0, 8.0}) {
      const auto [q, v] = bouncing(down, up, T);
      const Solution s = run(mass(fmt::format("if(v[0] > 0, -{}, -{})", up, down), 0.5, 0, T,
                                  R"({"name": "ground", "gap": "q[0]", "e": 0.5})"),
                             GetParam(), 1e-10);
      ASSERT_TRUE(s.succeeded()) << s.message;
      EXPECT_NEAR(s.q[0], q, 1e-7) << up << ", T = " << T;  // an accumulation of impacts is closed
      EXPECT_NEAR(s.v[0], v, 1e-7) << up << ", T = " << T;  // within the tolerance of velocities
      EXPECT_LT(s.events.size(), 250) << up << ", T = " << T;
    }
  }
}

TEST_P(Motions, ABallWithDragComesToRest) {  // drag bends at v = 0, which every impact and every apex passes
  if (GetParam().find("gauss") != std::string::npos) GTEST_SKIP() << "it closes no accumulation of impacts";
  const Solution s = run(mass("-9.81-0.2*v[0]*abs(v[0])", 0.2, 0, 2, R"({"name": "ground", "gap": "q[0]", "e": 0.5})"),
                         GetParam(), 1e-9);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_NEAR(s.q[0], 0, 1e-8);
  EXPECT_NEAR(s.v[0], 0, 1e-8);
}

TEST_P(Motions, CoulombOscillatorWrittenWithSignCrossesZero) {  // its force is larger than friction at every turn
  const Solution s = run(mass("-0.5*sign(v[0])-q[0]", 2, 0, 5), GetParam(), 1e-10);
  ASSERT_TRUE(s.succeeded()) << s.message;
  // q = 0.5 + 1.5 cos t until t = pi at -1; then -0.5 - 0.5 cos(t - pi) while v > 0
  EXPECT_NEAR(s.q[0], -0.5 - 0.5 * std::cos(5 - std::numbers::pi), 1e-7);
  EXPECT_NEAR(s.v[0], 0.5 * std::sin(5 - std::numbers::pi), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Located, Motions,
                         testing::Values("fesd_adaptive:radau-iia:4", "fesd_adaptive:gauss:4", "event_driven",
                                         "event_driven:dopri5", "event_driven:radau-iia:5", "cvode", "arkode"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::ranges::replace_if(
                               name, [](char ch) { return !std::isalnum(ch); }, '_');
                           return name;
                         });

TEST(Regions, FesdHasItsOrderThroughACorner) {
  const auto [q, v] = two_stiffnesses(1);
  const std::string scene = mass("-100*max(q[0],0)-20*min(q[0],0)", 1, 0, 1);
  for (const auto& [method, order] : {std::pair{"fesd:radau-iia:2", 3}, {"fesd:gauss:2", 4}, {"fesd:radau-iia:3", 5}}) {
    std::vector<double> errors;
    for (const double steps : {20.0, 40.0}) {
      const Solution s = run(scene, method, steps);
      ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
      errors.push_back(std::hypot(s.q[0] - q, s.v[0] - v));
    }
    EXPECT_GT(std::log2(errors[0] / errors[1]), order - 0.6) << method;  // steps that end at corners differ in length
  }
}

TEST(Regions, OfTwoBordersInOneStepTheFirstIsCrossedFirst) {  // 3 mm apart
  const std::string scene =
      mass("-22.981*q[0]-51.163*min(q[0]+0.259,0)-4.191*max(abs(q[0])-0.256,0)*sign(q[0])", 0.2, 0.921, 2);
  const Solution exact = run(scene, "event_driven", 1e-13);
  for (const char* method : {"fesd_adaptive:gauss:4", "fesd_adaptive:radau-iia:4", "event_driven"}) {
    const Solution s = run(scene, method, 1e-10);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(s.q[0], exact.q[0], 1e-8) << method;
  }
}

TEST(Regions, NumbersOfFunctionsDoNotDependOnTheRun) {  // GiNaC's own order depends on memory addresses
  std::vector<std::string> first;
  for (int n = 0; n < 20; ++n) {
    const auto problem =
        read_scene_text(mass("max(q[0]-0.3,0)+abs(v[0])-min(q[0]+0.2,0)+sign(sin(t))", 1, 0, 1), "scene");
    std::vector<std::string> formulas;
    std::vector<double> psi(problem->info().switches.size());
    problem->switching(problem->info().q0.data(), problem->info().v0.data(), psi.data());
    for (const double x : psi) formulas.push_back(fmt::format("{}", x));
    if (n == 0) first = formulas;
    EXPECT_EQ(formulas, first);
  }
}

TEST(Regions, AClosedContactStaysClosedAtABorder) {  // what it has drifted by would be a flight
  const std::string scene = R"json({"q0": [0.5, 0.2], "v0": [-0.7, 1.3], "T": 2, "M": [[1.3, 0], [0, 0.8]],
      "f": ["-5*q[0]+0.5*sign(sin(9.7*t+2.4))", "-9.81-3*sin(t)"],
      "contacts": [{"name": "hill", "gap": "q[1]-0.1*sin(q[0])", "e": 0, "mu": 0.1, "Jt": [["1", "0.1*cos(q[0])"]]}]})json";
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4", "cvode"}) {
    for (const double tolerance : {1e-6, 1e-9}) {
      const Solution s = run(scene, method, tolerance);
      ASSERT_TRUE(s.succeeded()) << s.message;
      EXPECT_EQ(std::ranges::count(s.events, EventKind::impact, &Event::kind), 1) << method << tolerance;
    }
  }
}

// --- Gaps with corners and jumps ------------------------------------------------------------------------------------

std::string block(const std::string& gap, double v, double T, double e = 0) {
  return fmt::format(
      R"({{"q0": [0, 0], "v0": [{}, 0], "T": {}, "M": [[1, 0], [0, 1]], "f": ["0", "-9.81"],
          "contacts": [{{"name": "ground", "gap": "{}", "e": {}}}]}})",
      v, T, gap, e);
}

TEST(Regions, ABlockSlidesOverTheEdgeOfATable) {
  for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven", "cvode"}) {
    const Solution s = run(block("q[1]-if(q[0]<1,0,-0.5)", 2, 0.7), method, 1e-10);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[1], -0.5 * 9.81 * 0.2 * 0.2, 1e-8) << method;
    ASSERT_EQ(s.events.size(), 1U) << method;
    EXPECT_EQ(s.events[0].kind, EventKind::detach) << method;
    EXPECT_NEAR(s.events[0].t, 0.5, 1e-9) << method;
  }
}

TEST(Regions, AtAConcaveCornerTheFaceIsHit) {  // into the foot of a ramp: v along it is cos(a) v, with e = 0
  for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven", "cvode"}) {
    const Solution s = run(block("q[1]-max(0,0.75*(q[0]-0.5))", 1, 0.55), method, 1e-10);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    const double speed = 0.8 - 0.6 * 9.81 * 0.05;  // along the ramp
    EXPECT_NEAR(s.v[0], 0.8 * speed, 1e-8) << method;
    EXPECT_NEAR(s.v[1], 0.6 * speed, 1e-8) << method;
  }
}

TEST(Regions, AGapThatJumpsBelowZeroEndsTheRun) {
  for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven"}) {
    const Solution s = run(block("q[1]-if(q[0]<1,0,0.5)", 2, 0.7), method, 1e-8);
    EXPECT_EQ(s.status, Status::infeasible) << method;
    EXPECT_NE(s.message.find("the gap of 'ground' jumps"), std::string::npos) << s.message;
    EXPECT_NEAR(s.t, 0.5, 1e-9) << method;
  }
}

TEST(Regions, ASwitchOnTheGridOfStepsIsPassed) {  // at 0.5, 1 and so on, up to rounding
  for (const int steps : {5, 6, 10, 12, 30}) {
    Settings settings;
    settings.steps = steps;
    const auto problem = read_scene_text(mass("sign(sin(2*pi*t))", 0, 0, 3), "scene");
    const Solution s = make_method("fesd:radau-iia:3")->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << steps << ": " << s.message;
    EXPECT_NEAR(s.q[0], 0.75, 1e-12) << steps;
    EXPECT_NEAR(s.v[0], 0, 1e-12) << steps;
  }
}

TEST(Regions, AStartWithTwoMotionsIsInfeasible) {
  for (const auto& [force, q, v] : {std::tuple{"if(v[0]**2 > 4, 1, -1)", 0.0, 2.0},
                                    {"if(q[0] > 0, 1, -1)", 0.0, 0.0},
                                    {"sign(v[0])", 1.0, 0.0},
                                    {"if(q[0]-0.1 > 0, 2, -1)-q[0]", 0.1, 0.0}}) {
    for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven", "fesd:radau-iia:3", "cvode", "arkode"}) {
      const Solution s = run(mass(force, q, v, 1), method, method[4] == ':' ? 100 : 1e-8);
      EXPECT_EQ(s.status, Status::infeasible) << method << ' ' << force << s.message;
      EXPECT_NE(s.message.find("not unique"), std::string::npos) << method << ' ' << force << s.message;
    }
  }
  for (const char* force : {"if(q[0] > 0, 1, 2)", "abs(q[0])", "-q[0]*abs(q[0])", "if(q[0] > 0, 1, -1)"}) {
    const Solution s = run(mass(force, 0, 1, 0.5), "event_driven", 1e-8);  // it crosses the border
    EXPECT_TRUE(s.succeeded()) << force << ": " << s.message;
  }
}

// --- Sliding --------------------------------------------------------------------------------------------------------

constexpr const char* kFixed = "fesd:radau-iia:3,elements=as_needed";
constexpr const char* kFar = R"({"name": "far", "gap": "q[0]+1000", "e": 0.5})";

/// A switched control of q_0 + v_0 that also turns another coordinate: no friction.
std::string turned(const std::string& contacts = kFar, const std::string& second = "") {
  return fmt::format(R"json({{"q0": [1, 0], "v0": [0, 0], "T": 5, "M": [[1, 0], [0, 1]],
      "f": ["-2*sign(q[0]+v[0])", "sign(q[0]+v[0]){}"], "contacts": [{}]}})json",
                     second, contacts);
}

class Sliding : public testing::TestWithParam<const char*> {};

TEST_P(Sliding, FollowsFilippov) {
  // q_0 + v_0 = 0 at t = sqrt(2) - 1; then q_0' = -q_0, and v_1' = -v_0'/2.
  const double t = std::sqrt(2.0) - 1, at = 1 - t * t, left = at * std::exp(t - 5), half = (at - left) / 2;
  for (const auto& [scene, q, v] :
       {std::tuple{turned(), left, -left},
        // (2) of sliding.h: s = (5 - 1) / 6 keeps v = 2 from t = 0.4 s on
        {mass("if(v[0]**2 > 4, -1, 5)", 0, 0, 1), 1.6, 2.0},
        // from the start, until 3 sin(t) = 2; then v' = 3 sin(t) - 2
        {mass("if(v[0]**2 > 1, -2, 2)+3*sin(t)", 0, 1, 1.2),
         1.2 + 3 * (1.2 - std::asin(2.0 / 3)) * std::cos(std::asin(2.0 / 3)) - 3 * (std::sin(1.2) - 2.0 / 3) -
             std::pow(1.2 - std::asin(2.0 / 3), 2),
         1 + 3 * (std::cos(std::asin(2.0 / 3)) - std::cos(1.2)) - 2 * (1.2 - std::asin(2.0 / 3))}}) {
    const Solution s = run(scene, GetParam(), GetParam() == std::string(kFixed) ? 200 : 1e-10);
    ASSERT_TRUE(s.succeeded()) << scene << s.message;
    EXPECT_NEAR(s.q[0], q, 1e-8) << scene;  // 100 tolerances
    EXPECT_NEAR(s.v[0], v, 1e-8) << scene;
    if (scene != turned()) continue;
    EXPECT_NEAR(s.q[1], t * t / 2 + (t - at / 2) * (5 - t) + half, 1e-8) << scene;
    EXPECT_NEAR(s.v[1], t + (left - at) / 2, 1e-8) << scene;
  }
}

TEST_P(Sliding, FollowsTwoBordersAtOnce) {  // M couples them; against step functions, a formulation of its own
  const std::string scene = R"json({"q0": [1, 0.5], "v0": [0, 0.3], "T": 2, "M": [[2, 0.5], [0.5, 1]],
      "f": ["-3*sign(v[0]+q[0])+0.3*sin(t)-q[1]", "-2*sign(v[1]+2*q[1])+0.5*q[0]"],
      "contacts": [{"name": "far", "gap": "q[0]+1000", "e": 0.5}]})json";
  static const Solution expected = run(scene, "fesd_homotopy:radau-iia:4", 8);  // seconds
  ASSERT_TRUE(expected.succeeded()) << expected.message;
  const Solution s = run(scene, GetParam(), GetParam() == std::string(kFixed) ? 60 : 1e-10);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LT((s.q - expected.q).cwiseAbs().maxCoeff(), 1e-8);  // errors of 8 steps of order 7, and of 60 of order 5
  EXPECT_LT((s.v - expected.v).cwiseAbs().maxCoeff(), 1e-8);
}

TEST_P(Sliding, EndsWhereAContactActsOnIt) {
  // A ground without friction does not act on q_0 + v_0; one with friction, and a wall, do.
  const double accuracy = GetParam() == std::string(kFixed) ? 100 : 1e-9;
  const Solution free = run(turned(R"({"name": "ground", "gap": "q[1]", "e": 0})", "-9.81"), GetParam(), accuracy);
  ASSERT_TRUE(free.succeeded()) << free.message;
  EXPECT_NEAR(free.v[0], -free.q[0], 1e-8);
  const Solution s = run(turned(R"({"name": "ground", "gap": "q[1]", "e": 0, "mu": 0.1, "Jt": [["1", "0"]]})", "-9.81"),
                         GetParam(), accuracy);
  EXPECT_EQ(s.status, Status::infeasible) << s.message;
  EXPECT_NE(s.message.find("slides"), std::string::npos) << s.message;
}

TEST_P(Sliding, EndsWithAnImpact) {  // on a wall, after which q_0 + v_0 > 0, and the mass comes to rest there
  const double t_0 = std::sqrt(2.0) - 1, t_1 = t_0 + std::log((1 - t_0 * t_0) / 0.5);  // of the impact, with v = -0.5
  for (const auto& [T, q, v] : {std::tuple{t_1 + 0.2, 0.5 + 0.25 * 0.2 - 0.2 * 0.2, 0.25 - 2 * 0.2}, {3.0, 0.5, 0.0}}) {
    const std::string scene = fmt::format(R"json({{"q0": [1, 0], "v0": [0, 0], "T": {}, "M": [[1, 0], [0, 1]],
        "f": ["-2*sign(q[0]+v[0])", "sign(q[0]+v[0])"],
        "contacts": [{{"name": "wall", "gap": "q[0]-0.5", "e": 0.5}}]}})json",
                                          T);
    const Solution s = run(scene, GetParam(), GetParam() == std::string(kFixed) ? 100 : 1e-10);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(s.q[0], q, 1e-8);  // 100 tolerances
    EXPECT_NEAR(s.v[0], v, 1e-8);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Sliding,
                         testing::Values("event_driven", "fesd_adaptive:radau-iia:4", kFixed, "cvode", "arkode",
                                         "ida"));

TEST(Sliding, TimeSteppingThatLocatesSwitchesDeclines) {  // it would chatter, with an error of 1e-6 at 1e-9
  for (const char* method : {"extrapolated_moreau", "event_capturing"}) {
    const Solution s = run(turned(), method, method[0] == 'e' && method[1] == 'v' ? 1000 : 1e-8);
    EXPECT_EQ(s.status, Status::infeasible) << method << s.message;
    EXPECT_NE(s.message.find("slides"), std::string::npos) << s.message;
  }
}

TEST(Sliding, StaysAStatusWhereTheJumpIsNotInTheForceAlone) {  // the mass changes, too
  const std::string scene = R"json({"q0": [0], "v0": [0], "T": 1, "M": [["if(v[0]**2 > 4, 2, 1)"]],
      "f": ["if(v[0]**2 > 4, -1, 5)"], "contacts": [{"name": "far", "gap": "q[0]+1000", "e": 0.5}]})json";
  EXPECT_THROW(read_scene_text(scene, "scene"), InputError);  // M is a function of q
  const std::string joint = R"json({"q0": [0, 0], "v0": [0, 0], "T": 1, "M": [[1, 0], [0, 1]],
      "f": ["if(v[0]**2 > 4, -1, 5)", "0"], "contacts": [{"name": "pin", "gap": "q[0]-q[1]", "bilateral": true}]})json";
  const Solution s = run(joint, "event_driven", 1e-8);
  EXPECT_EQ(s.status, Status::infeasible) << s.message;
  EXPECT_NE(s.message.find("'pin' acts on it"), std::string::npos) << s.message;
}

// --- Between the steps, and derivatives -----------------------------------------------------------------------------

TEST(Regions, TheMotionIsContinuous) {
  const std::string scene = mass("-100*max(q[0],0)-20*min(q[0],0)", 1, 0, 3);
  for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven", "cvode"}) {
    Settings settings;
    settings.recording = Recording::motion;
    const Solution s = run(scene, method, 1e-9, settings);
    ASSERT_FALSE(s.motion.empty());
    EXPECT_NEAR(s.motion.end(), 3, 1e-12);
    for (const double t : {0.2, 0.5, 1.0, 1.7, 2.9}) {
      Vector q, v;
      s.motion.at(t, q, v);
      EXPECT_NEAR(q[0], two_stiffnesses(t).first, 1e-5) << method << " at " << t;  // interpolated
    }
  }
}

TEST(Regions, DerivativesPassCornersAndJumps) {
  const std::string params = R"("k": "20", "F": "0.7", "a": "0.4")";
  const std::string far = R"({"name": "far", "gap": "q[0]+1000", "e": 0.5})";
  for (const std::string& force :
       {std::string("-100*max(q[0],0)-k*min(q[0],0)"), std::string("if(q[0] < a, 0, F)-q[0]"),
        std::string("if(t < a, F, -F)-q[0]**3"), std::string("-F*v[0]*abs(v[0])-k*q[0]"),
        std::string("if(v[0]**2+q[0] > 1.8+a*t, -2*F, 3*F)+k*t*t*t")}) {  // slides, and is pulled away
    const std::string scene = mass(force, 0.1, 1.3, 0.9, far, params);
    const auto problem = read_scene_text(scene, "scene");
    for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven"}) {
      const auto m = make_method(method);
      Settings settings;
      settings.tolerance = 1e-12;
      const std::vector<std::string> names{"q0:0", "v0:0", "param:k", "param:F", "param:a"};
      settings.sensitivities = names;
      const Solution s = m->solve(*problem, settings);
      ASSERT_TRUE(s.succeeded()) << s.message;
      ASSERT_EQ(s.dq.cols(), 5);
      settings.sensitivities.clear();
      for (std::size_t j = 0; j < names.size(); ++j) {
        const auto variable = find_variable(problem->info(), names[j]);
        const double value = variables(problem->info())[static_cast<std::size_t>(variable)].value, h = 1e-5;
        const Solution up = m->solve(*with_value(*problem, variable, value + h), settings),
                       down = m->solve(*with_value(*problem, variable, value - h), settings);
        const auto column = static_cast<Eigen::Index>(j);
        EXPECT_NEAR(s.dq(0, column), (up.q[0] - down.q[0]) / (2 * h), 3e-6) << force << ' ' << method << names[j];
        EXPECT_NEAR(s.dv(0, column), (up.v[0] - down.v[0]) / (2 * h), 3e-5) << force << ' ' << method << names[j];
      }
    }
  }
}

TEST(Regions, DerivativesByParametersOfTheStart) {  // which later pieces do not start with
  const std::string scene = R"json({"params": {"x": "0.3"}, "q0": ["x"], "v0": ["-2*x"], "T": 1.4, "M": [[1]],
      "f": ["-30*max(q[0],0)-9*min(q[0],0)+x"], "contacts": [{"name": "far", "gap": "q[0]+1000", "e": 0.5}]})json";
  const auto problem = read_scene_text(scene, "scene");
  for (const char* method : {"fesd_adaptive:radau-iia:4", "event_driven"}) {
    Settings settings;
    settings.tolerance = 1e-12;
    settings.sensitivities = {"param:x"};
    const auto m = make_method(method);
    const Solution s = m->solve(*problem, settings);
    settings.sensitivities.clear();
    const auto variable = find_variable(problem->info(), "param:x");
    const Solution up = m->solve(*with_value(*problem, variable, 0.3 + 1e-5), settings),
                   down = m->solve(*with_value(*problem, variable, 0.3 - 1e-5), settings);
    EXPECT_NEAR(s.dq(0, 0), (up.q[0] - down.q[0]) / 2e-5, 1e-6) << method;
    EXPECT_NEAR(s.dv(0, 0), (up.v[0] - down.v[0]) / 2e-5, 1e-5) << method;
  }
}

}  // namespace
}  // namespace ricochet
