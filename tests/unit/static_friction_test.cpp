// Contacts that have a larger coefficient of friction while they stick (problems/regions/static_friction.h), against
// closed forms.
#include "problems/regions/static_friction.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "problems/input_error.h"
#include "reference/event_located.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kGravity = 9.81;

// The methods that locate events, with errors of ten to a hundred times their tolerance.
const std::vector<MethodRun> kStaticFrictionRuns = {{"event_driven", 0, 1e-12, 1e-10},
                                                    {"event_driven:radau-iia", 0, 1e-12, 1e-10},
                                                    {"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-10},
                                                    {"fesd:radau-iia:4", 300, 0, 1e-10},
                                                    {"cvode", 0, 1e-13, 1e-10},
                                                    {"ida", 0, 1e-12, 1e-9}};

/// A block of unit mass on the ground q[1] = 0, with weight. @param f  its horizontal load @param contact  of the ground
std::string block(const std::string& x0, const std::string& v0, const std::string& f, double T,
                  const std::string& contact = R"("mu": 0.3, "mu_static": 0.5)", const std::string& y0 = "0",
                  const std::string& vy0 = "0") {
  return fmt::format(R"({{"q0": ["{}", "{}"], "v0": ["{}", "{}"], "T": {}, "M": [[1, 0], [0, 1]],
    "f": ["{}", "-9.81"], "contacts": [{{"name": "ground", "gap": "q[1]", "Jt": [["1", "0"]], {}}}]}})",
                     x0, y0, v0, vy0, T, f, contact);
}

double state_error(const Solution& s, std::initializer_list<double> q, std::initializer_list<double> v) {
  double error = 0;
  Eigen::Index k = 0;
  for (const double x : q) error = std::max(error, std::abs(s.q[k++] - x));
  k = 0;
  for (const double x : v) error = std::max(error, std::abs(s.v[k++] - x));
  return error;
}

void expect_static_end(const std::string& scene, std::initializer_list<double> q, std::initializer_list<double> v,
                       const std::vector<MethodRun>& runs = kStaticFrictionRuns) {
  const auto problem = read_scene_text(scene, "scene");
  for (const MethodRun& how : runs) {
    const Solution s = run_as(*problem, how);
    ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
    EXPECT_EQ(s.t, problem->info().end_time) << how.method;
    EXPECT_LE(state_error(s, q, v), how.error) << how.method;
  }
}

// --- Closed forms ---------------------------------------------------------------------------------------------------

/// Position and velocity of a mass m on a spring k whose end moves with the speed V, from rest at 0 with a relaxed
/// spring. It breaks loose at k V t = F_s; then y = x - V t + F_k / k obeys y'' = -w^2 y with y = -D and y' = -V, where
/// D = (F_s - F_k) / k. Slip lasts for w t = 2 pi - 2 atan(D w / V) and ends at y = D, so that the next one begins after
/// 2 D / V.
struct StickSlip {
  double m, k, V, F_s, F_k;
  double x = 0, v = 0, period = 0, first = 0;

  void at(double t) {
    const double w = std::sqrt(k / m), D = (F_s - F_k) / k;
    const double slip = (2 * std::numbers::pi - 2 * std::atan(D * w / V)) / w;
    first = F_s / (k * V);
    period = slip + 2 * D / V;
    if (t < first) return;
    const double cycles = std::floor((t - first) / period);
    const double tau = std::min(t - first - cycles * period, slip), end = first + cycles * period + tau;
    x = V * end - F_k / k - D * std::cos(w * tau) - V / w * std::sin(w * tau);
    v = tau < slip ? V + D * w * std::sin(w * tau) - V * std::cos(w * tau) : 0;
  }
};

TEST(StaticFriction, StickSlipOscillatorHasItsPeriod) {
  StickSlip exact{.m = 1, .k = 20, .V = 0.3, .F_s = 0.5 * kGravity, .F_k = 0.3 * kGravity};
  for (const double T : {0.8, 1.1, 4.0, 5.0}) {
    exact.at(T);
    expect_static_end(block("0", "0", "20*(0.3*t-q[0])", T), {exact.x, 0}, {exact.v, 0});
  }
  const auto problem = read_scene_file(test_data("stick_slip.json"));
  for (const MethodRun& how : kStaticFrictionRuns) {
    const Solution s = run_as(*problem, how);
    std::vector<double> breaks;
    for (const Event& event : s.events) {
      if (event.kind == EventKind::stick_to_slip) breaks.push_back(event.t);
    }
    ASSERT_EQ(breaks.size(), 4U) << how.method;
    EXPECT_EQ(s.events.size(), 7U) << how.method;
    EXPECT_NEAR(breaks[0], exact.first, 1e-10) << how.method;
    for (std::size_t n = 1; n < breaks.size(); ++n)
      EXPECT_NEAR(breaks[n] - breaks[n - 1], exact.period, 1e-9) << how.method;
  }
}

TEST(StaticFriction, BlockOnABeltIsTheSameOscillator) {
  StickSlip exact{.m = 1, .k = 20, .V = 0.3, .F_s = 0.5 * kGravity, .F_k = 0.3 * kGravity};
  exact.at(4);
  const std::string scene = block("0", "0.3", "-20*q[0]", 4, R"("mu": 0.3, "mu_static": 0.5, "vt_drive": ["-0.3"])");
  expect_static_end(scene, {0.3 * 4 - exact.x, 0}, {0.3 - exact.v, 0});
}

TEST(StaticFriction, FrictionElementOscillates) {
  StickSlip exact{.m = 1, .k = 20, .V = 0.3, .F_s = 5, .F_k = 3};
  exact.at(4);
  expect_static_end(
      R"~({"params": {"F": "3"}, "q0": [0], "v0": [0], "T": 4, "M": [[1]], "f": ["20*(0.3*t-q[0])"],
          "friction": [{"name": "guide", "Jt": [["1"]], "bound": "F", "static_ratio": "5/F"}]
})~",
      {exact.x}, {exact.v});
}

/// The plane turns slowly enough for its own acceleration to be negligible: gravity turns in its frame.
TEST(StaticFriction, TiltingPlaneReleasesAtTheAngleOfStaticFriction) {
  const double a = 0.2, T = 4, begin = std::atan(0.5) / a;
  const auto v = [&](double t) { return kGravity / a * (-std::cos(a * t) - 0.3 * std::sin(a * t)); };
  const auto x = [&](double t) { return kGravity / (a * a) * (-std::sin(a * t) + 0.3 * std::cos(a * t)); };
  expect_static_end(
      R"~({"q0": [0, 0], "v0": [0, 0], "T": 4, "M": [[1, 0], [0, 1]], "f": ["9.81*sin(0.2*t)", "-9.81*cos(0.2*t)"],
          "contacts": [{"name": "plane", "gap": "q[1]", "mu": 0.3, "mu_static": 0.5, "Jt": [["1", "0"]]}]
})~",
      {x(T) - x(begin) - v(begin) * (T - begin), 0}, {v(T) - v(begin), 0},
      {{"event_driven", 0, 1e-12, 1e-9}, {"fesd_adaptive:radau-iia:4", 0, 1e-12, 1e-9}, {"cvode", 0, 1e-13, 1e-9}});
}

// A load between both bounds, 0.3 g < 4 < 0.5 g.
TEST(StaticFriction, StartDecides) {
  const double slow = 4 - 0.3 * kGravity, fast = 4 + 0.3 * kGravity;
  expect_static_end(block("0", "0", "4", 1), {0, 0}, {0, 0});                          // at rest it sticks
  expect_static_end(block("0", "0.1", "4", 1), {0.1 + slow / 2, 0}, {0.1 + slow, 0});  // with slip it slips
  expect_static_end(block("0", "-1", "4", 1), {-1 / (2 * fast), 0}, {0, 0});           // slip ends
  expect_static_end(block("0", "0", "5", 1), {(5 - 0.3 * kGravity) / 2, 0}, {5 - 0.3 * kGravity, 0});  // too much
}

TEST(StaticFriction, SlipReversesUnderALoadBeyondBoth) {
  const double before = 6 + 0.3 * kGravity, after = 6 - 0.3 * kGravity, stop = 1 / before, left = 1 - stop;
  expect_static_end(block("0", "-1", "6", 1), {-0.5 * stop + after * left * left / 2, 0}, {after * left, 0});
}

TEST(StaticFriction, APulseBreaksLoose) {
  const double slow = 4 - 0.3 * kGravity, fast = 6 - 0.3 * kGravity, v = 0.1 * fast;
  expect_static_end(block("0", "0", "if(t<0.5,4,if(t<0.6,6,4))", 1), {0.005 * fast + 0.4 * v + 0.08 * slow, 0},
                    {v + 0.4 * slow, 0});
  expect_static_end(block("0", "0", "if(t<0.5,4,if(t<0.6,4.9,4))", 1), {0, 0}, {0, 0});
}

// --- Impacts --------------------------------------------------------------------------------------------------------

TEST(StaticFriction, ImpulsesHaveTheCoefficientOfSlip) {
  // It lands at t = 0.2 with v = (v_x, -2 g / 10 - 1): slip loses mu of the normal impulse.
  const double fall = 0.2, vy = 1 + kGravity * fall, height = fall + kGravity * fall * fall / 2;
  const std::string y0 = fmt::format("{:.17g}", height);
  const auto scene = [&](double vx, const char* f) {
    return block("0", fmt::format("{}", vx), f, 0.4, R"("mu": 0.3, "mu_static": 0.5)", y0, "-1");
  };
  const double v = 2 - 0.3 * vy, x = 2 * fall + v * 0.2 - 0.3 * kGravity * 0.02;
  expect_static_end(scene(2, "0"), {x, 0}, {v - 0.3 * kGravity * 0.2, 0});
  // The impulse ends slip, and a load between both bounds does not begin it again.
  expect_static_end(scene(-0.5, "4"), {-0.5 * fall + 4 * fall * fall / 2, 0}, {0, 0});
  // It would stop with mu_static, but not with mu.
  const double fast = 0.4 * vy, left = fast - 0.3 * vy, stop = left / (0.3 * kGravity);
  ASSERT_LT(stop, 0.2);
  expect_static_end(scene(fast, "0"), {fast * fall + 0.5 * left * stop, 0}, {0, 0});
}

TEST(StaticFriction, AHitAlongTheGroundBreaksLoose) {
  // A ball of 1 kg hits a block that rests under a load between both bounds. e = 1: they exchange velocities.
  const std::string scene =
      R"~({"q0": [0, 0, -0.6], "v0": [0, 0, 2], "T": 1, "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
          "f": ["-4", "-9.81", "0"],
          "contacts": [{"name": "ground", "gap": "q[1]", "mu": 0.3, "mu_static": 0.5, "Jt": [["1", "0", "0"]]},
                       {"name": "hit", "gap": "q[0]-q[2]", "e": 1}]})~";
  const double slip = 4 + 0.3 * kGravity, stop = 2 / slip;
  ASSERT_LT(0.3 + stop, 1);
  expect_static_end(scene, {stop, 0, 0}, {0, 0, 0});
}

TEST(StaticFriction, ABounceOnABlockThatSticks) {
  // A ball falls on a block that a load between both bounds pulls: the impulse through the block has no tangential part,
  // so that the block sticks on.
  const std::string scene =
      R"~({"q0": [0, 0, 0.2], "v0": [0, 0, 0], "T": 0.35, "M": [[1, 0, 0], [0, 1, 0], [0, 0, 0.1]],
          "f": ["4", "-9.81", "-0.981"],
          "contacts": [{"name": "ground", "gap": "q[1]", "mu": 0.3, "mu_static": 0.5, "Jt": [["1", "0", "0"]]},
                       {"name": "top", "gap": "q[2]-q[1]", "e": 0.5}]})~";
  const double fall = std::sqrt(0.4 / kGravity), up = 0.5 * kGravity * fall, left = 0.35 - fall;
  ASSERT_LT(left, up / kGravity * 2);
  expect_static_end(scene, {0, 0, up * left - kGravity * left * left / 2}, {0, 0, up - kGravity * left});
}

// --- Several contacts -----------------------------------------------------------------------------------------------

TEST(StaticFriction, BlocksThatBreakLooseTogether) {
  StickSlip exact{.m = 1, .k = 20, .V = 0.3, .F_s = 0.5 * kGravity, .F_k = 0.3 * kGravity};
  exact.at(3);
  expect_static_end(
      R"~({"q0": [0, 0, 0, 0], "v0": [0, 0, 0, 0], "T": 3, "M": [[1,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]],
          "f": ["20*(0.3*t-q[0])", "-9.81", "20*(0.3*t-q[2])", "-9.81"],
          "contacts": [{"name": "a", "gap": "q[1]", "mu": 0.3, "mu_static": 0.5, "Jt": [["1", "0", "0", "0"]]},
                       {"name": "b", "gap": "q[3]", "mu": 0.3, "mu_static": 0.5, "Jt": [["0", "0", "1", "0"]]}]
})~",
      {exact.x, 0, exact.x, 0}, {exact.v, 0, exact.v, 0});
}

/// a pulls b by a spring that is relaxed at first.
TEST(StaticFriction, ElementsBreakLooseOneAfterTheOther) {
  const std::string scene =
      R"~({"q0": [0, 0], "v0": [0, 0], "T": 1, "M": [[1, 0], [0, 1]], "f": ["6*t-50*(q[0]-q[1])", "50*(q[0]-q[1])"],
          "friction": [{"name": "a", "Jt": [["1", "0"]], "bound": "2", "static_ratio": "1.5"},
                       {"name": "b", "Jt": [["0", "1"]], "bound": "2", "static_ratio": "1.5"}]})~";
  const auto problem = read_scene_text(scene, "scene");
  const Solution a = run_as(*problem, {"event_driven", 0, 1e-12}),
                 b = run_as(*problem, {"fesd_adaptive:radau-iia:4", 0, 1e-12});
  ASSERT_TRUE(a.succeeded()) << a.message;
  ASSERT_TRUE(b.succeeded()) << b.message;
  EXPECT_LE((a.q - b.q).norm() + (a.v - b.v).norm(), 1e-10);
  ASSERT_GE(a.events.size(), 2U);
  EXPECT_NEAR(a.events[0].t, 0.5, 1e-12);  // a reaches 3 N
}

/// The division of the load among the feet of a box is not unique, and so is which of them breaks loose first.
TEST(StaticFriction, SharedLoadsEndTheRun) {
  const auto problem = read_scene_text(
      R"~({"q0": [0, 0, 0], "v0": [0, 0, 0], "T": 2, "M": [[1, 0, 0], [0, 1, 0], [0, 0, 0.1]],
           "f": ["3*t", "-9.81", "0"],
           "contacts": [
             {"name": "left", "gap": "q[1]-0.5*sin(q[2])", "mu": 0.3, "mu_static": 0.5, "Jt": [["1", "0", "0.2"]]},
             {"name": "right", "gap": "q[1]+0.5*sin(q[2])", "mu": 0.3, "mu_static": 0.5, "Jt": [["1", "0", "0.2"]]}]})~",
      "scene");
  for (const MethodRun& how : kStaticFrictionRuns) {
    const Solution s = run_as(*problem, how);
    EXPECT_EQ(s.status, Status::infeasible) << how.method;
    EXPECT_NE(s.message.find("'left' shares its load"), std::string::npos) << how.method << ": " << s.message;
  }
}

// --- Random scenes --------------------------------------------------------------------------------------------------

double uniform(std::mt19937& generator, double low, double high) {
  return low + (high - low) * static_cast<double>(generator()) / 4294967296.0;
}

/// A mass m on a spring k, stretched by s at first, whose end moves with V > 0. Slip is harmonic about a centre that
/// moves; the first time with v = 0 is one of two arcs.
struct SpringBlock {
  double m, k, V, s, F_s, F_k;
  double t = 0, x = 0, v = 0;

  double pull() const { return k * (V * t + s - x); }

  void go_to(double T) {
    const double w = std::sqrt(k / m);
    while (t < T) {
      double sigma = v > 0 ? 1 : v < 0 ? -1 : 0;
      const bool begins = sigma == 0;
      if (begins && std::abs(pull()) <= F_s * (1 - 1e-12)) {
        t = std::min(T, t + (F_s - pull()) / (k * V));
        continue;
      }
      if (begins) sigma = pull() > 0 ? 1 : -1;
      const double centre = V * t + s - sigma * F_k / k, A = x - centre, B = (v - V) / w, R = std::hypot(A, B);
      double until = std::numeric_limits<double>::infinity();
      if (R > V / w) {  // v = V + w (-A sin + B cos) = V - w R sin(theta - psi)
        const double psi = std::atan2(B, A), arc = std::asin(V / (w * R));
        for (const double root : {psi + arc, psi + std::numbers::pi - arc}) {
          double theta = std::fmod(root, 2 * std::numbers::pi);
          if (theta < 0) theta += 2 * std::numbers::pi;
          const bool is_start = begins && (theta < 1e-7 || theta > 2 * std::numbers::pi - 1e-7);
          if (!is_start) until = std::min(until, theta / w);
        }
      }
      const double duration = std::min(until, T - t), theta = w * duration;
      x = centre + V * duration + A * std::cos(theta) + B * std::sin(theta);
      v = until <= T - t ? 0 : V + w * (-A * std::sin(theta) + B * std::cos(theta));
      t += duration;
    }
  }
};

TEST(StaticFriction, RandomOscillatorsHaveTheirClosedForm) {
  std::mt19937 generator(44);
  for (int n = 0; n < 120; ++n) {
    const double mu = uniform(generator, 0.05, 0.5), mu_static = mu * uniform(generator, 1.02, 2.5);
    const double k = uniform(generator, 5, 60), V = uniform(generator, 0.1, 1), s = uniform(generator, -0.5, 0.5);
    const double v0 = n % 3 == 0 ? 0 : uniform(generator, -1, 1), T = uniform(generator, 1, 3);
    SpringBlock exact{.m = 1, .k = k, .V = V, .s = s, .F_s = mu_static * kGravity, .F_k = mu * kGravity, .v = v0};
    exact.go_to(T);
    const std::string f = fmt::format("{:.17g}*({:.17g}*t+({:.17g})-q[0])", k, V, s);
    const auto problem = read_scene_text(block("0", fmt::format("{:.17g}", v0), f, T,
                                               fmt::format(R"("mu": {:.17g}, "mu_static": {:.17g})", mu, mu_static)),
                                         "scene");
    for (const MethodRun& how : std::vector<MethodRun>{{"event_driven", 0, 1e-11, 1e-8},
                                                       {"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-8},
                                                       {"cvode", 0, 1e-12, 1e-8}}) {
      const Solution run = run_as(*problem, how);
      ASSERT_TRUE(run.succeeded()) << how.method << ", scene " << n << ": " << run.message;
      EXPECT_LE(state_error(run, {exact.x, 0}, {exact.v, 0}), how.error) << how.method << ", scene " << n;
    }
  }
}

/// Blocks in a row on springs, of which the first may fall and hop.
TEST(StaticFriction, MethodsAgreeOnRandomRows) {
  std::mt19937 generator(45);
  int followed = 0, declined = 0;
  for (int n = 0; n < 100; ++n) {
    const int blocks = 2 + n % 2;
    std::string q0, v0, M, f, contacts;
    const double k = uniform(generator, 10, 60), V = uniform(generator, 0.2, 1);
    for (int i = 0; i < blocks; ++i) {
      const char* comma = i == 0 ? "" : ", ";
      const double height = i == 0 && n % 4 == 0 ? uniform(generator, 0.01, 0.1) : 0;
      const int x = 2 * i, y = 2 * i + 1;
      q0 += fmt::format("{}0, {:.17g}", comma, height);
      v0 += fmt::format("{}{:.17g}, 0", comma, n % 3 == 0 ? uniform(generator, -0.5, 0.5) : 0);
      for (const int row : {x, y}) {
        M += row == 0 ? "[" : ", [";
        for (int column = 0; column < 2 * blocks; ++column)
          M += fmt::format("{}{}", column == 0 ? "" : ", ", row == column ? 1 : 0);
        M += "]";
      }
      std::string load = i + 1 == blocks ? fmt::format("{:.17g}*({:.17g}*t-q[{}])", k, V, x)
                                         : fmt::format("{:.17g}*(q[{}]-q[{}])", k, x + 2, x);
      if (i > 0) load += fmt::format("+{:.17g}*(q[{}]-q[{}])", k, x - 2, x);
      f += fmt::format("{}\"{}\", \"-9.81\"", comma, load);
      std::string J;
      for (int column = 0; column < 2 * blocks; ++column)
        J += fmt::format("{}{}", column == 0 ? "" : ", ", column == x ? 1 : 0);
      const double mu = uniform(generator, 0.1, 0.5);
      contacts += fmt::format(
          R"({}{{"name": "block {}", "gap": "q[{}]", "e": {}, "mu": {:.17g}, "mu_static": {:.17g}, "Jt": [[{}]]}})",
          comma, i, y, n % 8 == 0 ? 0.3 : 0, mu, mu * uniform(generator, 1.05, 2), J);
    }
    const auto problem =
        read_scene_text(fmt::format(R"({{"q0": [{}], "v0": [{}], "T": 2, "M": [{}], "f": [{}], "contacts": [{}]}})", q0,
                                    v0, M, f, contacts),
                        "scene");
    const Solution a = run_as(*problem, {"event_driven", 0, 1e-11}),
                   b = run_as(*problem, {"fesd_adaptive:radau-iia:4", 0, 1e-11}),
                   c = run_as(*problem, {"cvode", 0, 1e-12});
    if (n % 8 == 0) {  // bounces that accumulate may end event location
      for (const Solution* other : {&b, &c}) {
        if (!a.succeeded() || !other->succeeded()) continue;
        EXPECT_LE((a.q - other->q).norm() + (a.v - other->v).norm(), 1e-7) << n;
      }
      ++(b.succeeded() ? followed : declined);
      continue;
    }
    ASSERT_TRUE(a.succeeded()) << n << ": " << a.message;
    ASSERT_TRUE(b.succeeded()) << n << ": " << b.message;
    ASSERT_TRUE(c.succeeded()) << n << ": " << c.message;
    EXPECT_LE((a.q - b.q).norm() + (a.v - b.v).norm(), 1e-7) << n;
    EXPECT_LE((a.q - c.q).norm() + (a.v - c.v).norm(), 1e-7) << n;
  }
  EXPECT_GT(followed, declined);
}

// --- Equal coefficients, declined methods, input ----------------------------------------------------------------------

TEST(StaticFriction, EqualCoefficientsChangeNothing) {
  const std::string plain = block("0", "0", "20*(0.3*t-q[0])", 2, R"("mu": 0.3)"),
                    equal = block("0", "0", "20*(0.3*t-q[0])", 2, R"("mu": 0.3, "mu_static": 0.3)"),
                    nearly = block("0", "0", "20*(0.3*t-q[0])", 2, R"("mu": 0.3, "mu_static": 0.3000000000003)");
  EXPECT_FALSE(read_scene_text(equal, "scene")->info().has_static_friction());
  for (const MethodRun& how : kStaticFrictionRuns) {
    const Solution a = run_as(*read_scene_text(plain, "scene"), how), b = run_as(*read_scene_text(equal, "scene"), how),
                   c = run_as(*read_scene_text(nearly, "scene"), how);
    EXPECT_EQ(a.q, b.q) << how.method;
    EXPECT_EQ(a.v, b.v) << how.method;
    ASSERT_TRUE(c.succeeded()) << how.method << ": " << c.message;
    EXPECT_LE((a.q - c.q).norm() + (a.v - c.v).norm(), how.error) << how.method;
  }
}

TEST(StaticFriction, OtherMethodsDecline) {
  const auto problem = read_scene_text(block("0", "0", "4", 1), "scene");
  for (const char* method :
       {"moreau_jean", "time_freezing:radau-iia:3", "sap", "extrapolated_moreau", "event_capturing"}) {
    const Support support = make_method(method)->can_run(problem->info());
    EXPECT_FALSE(support.ok) << method;
    EXPECT_NE(support.reason.find("'ground' has another coefficient"), std::string::npos) << support.reason;
  }
  Settings settings;
  settings.tolerance = 1e-8;
  settings.sensitivities = {"q0:0"};
  EXPECT_THROW(make_method("event_driven")->solve(*problem, settings), InputError);
}

TEST(StaticFriction, BadFieldsAreNamed) {
  const auto expect = [](const std::string& contact, const std::string& text) {
    try {
      validate(*read_scene_text(block("0", "0", "4", 1, contact), "scene"));
      ADD_FAILURE() << contact;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  };
  expect(R"("mu": 0.3, "mu_static": 0.2)", "mu_static (ground) = 0.2: a finite number >= mu = 0.3 is required");
  expect(R"("mu": 0.3, "mu_static": -1)", "mu_static");
  expect(R"("mu_static": 0.2)", "a coefficient mu > 0");
  expect(R"~("mu": "if(q[0]<1,0.3,0.2)", "mu_static": 0.5)~", "that does not vary");
  expect(R"~("mu": 0.3, "mu_static": "q[0]")~", "q");
}

TEST(StaticFriction, ExportReadsBack) {
  const std::string element = R"~({"q0": [0], "v0": [0], "T": 1, "M": [[1]], "f": ["20*(0.3*t-q[0])"],
    "friction": [{"name": "guide", "Jt": [["1"]], "bound": "1", "static_ratio": "2"}]})~";
  for (const std::string& scene : {block("0", "0", "20*(0.3*t-q[0])", 2), element})
    expect_export_reads_back(*read_scene_text(scene, "scene"), {"event_driven", 0, 1e-9});
}

TEST(StaticFriction, RunsEndWhereAFormulaVanishes) {
  const std::string scene = block("0", "0", "20*(0.3*t-q[0])", 2);
  const std::string until = R"~(, "until": "q[0]-0.1"})~";
  const auto problem = read_scene_text(scene.substr(0, scene.size() - 1) + until, "scene");
  for (const MethodRun& how : kStaticFrictionRuns) {
    const Solution s = run_as(*problem, how);
    ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
    EXPECT_LT(s.t, 2) << how.method;
    EXPECT_NEAR(s.q[0], 0.1, 1e-10) << how.method;
  }
}

TEST(StaticFriction, MotionHasNoGaps) {
  const auto problem = read_scene_text(block("0", "0", "20*(0.3*t-q[0])", 4), "scene");
  for (const MethodRun& how : kStaticFrictionRuns) {
    const Solution s = run_as(*problem, how, {}, Recording::motion);
    ASSERT_FALSE(s.motion.empty()) << how.method;
    for (std::size_t piece = 1; piece < s.motion.n_pieces(); ++piece)
      ASSERT_NEAR(s.motion.begin_of(piece), s.motion.end_of(piece - 1), 1e-12) << how.method;
    EXPECT_NEAR(s.motion.end(), 4, 1e-12) << how.method;
    Vector q, v;
    StickSlip exact{.m = 1, .k = 20, .V = 0.3, .F_s = 0.5 * kGravity, .F_k = 0.3 * kGravity};
    exact.at(1);
    s.motion.at(1, q, v);
    EXPECT_NEAR(q[0], exact.x, 1e-7) << how.method;  // the accuracy of interpolations
  }
}

}  // namespace
}  // namespace ricochet
