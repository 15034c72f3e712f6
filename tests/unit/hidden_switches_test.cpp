// What neither the ends of a step nor its stages show: short pulses of a load on what rests or slides freely, belts that
// overtake what slides on them for a moment, slip that stops and starts again.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "methods/contact_laws/load_search.h"
#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

constexpr double kG = 9.81, kMu = 0.3;

/// The zero of an increasing or decreasing function between two points.
double zero_of(const auto& f, double from, double to) {
  const bool falls = f(from) > 0;
  for (int k = 0; k < 200; ++k) {
    const double middle = 0.5 * (from + to);
    ((f(middle) > 0) == falls ? from : to) = middle;
  }
  return 0.5 * (from + to);
}

/// A exp(-((t - t_0) / w)^2), and its integrals from t_0 on.
struct Pulse {
  double A, w, t_0 = 1;

  std::string text() const { return fmt::format("{}*exp(-((t-{})/{})**2)", A, t_0, w); }
  double operator()(double t) const { return A * std::exp(-(t - t_0) * (t - t_0) / (w * w)); }
  double once(double t) const { return 0.5 * A * w * std::sqrt(std::numbers::pi) * std::erf((t - t_0) / w); }
  double twice(double t) const { return (t - t_0) * once(t) + 0.5 * w * w * ((*this)(t)-A); }
  /// Where it reaches a value, before and after t_0.
  double width(double value) const { return w * std::sqrt(std::log(A / value)); }
};

std::string block(const std::string& f_x, const std::string& f_y, double v_x, const std::string& contact, double T) {
  return fmt::format(
      R"({{"q0": [0, 0], "v0": [{}, 0], "T": {}, "M": [[1, 0], [0, 1]], "f": ["{}", "-9.81+{}"],
          "contacts": [{{"name": "ground", "gap": "q[1]", "e": 0 {}}}]}})",
      v_x, T, f_x, f_y, contact);
}

constexpr const char* kRough = R"(, "mu": 0.3, "Jt": [["1", "0"]])";

class HiddenSwitches : public testing::TestWithParam<std::tuple<const char*, double>> {
 protected:
  Solution run(const std::string& scene) const {
    const auto problem = read_scene_text(scene, "pulse");
    Settings settings;
    settings.tolerance = std::get<1>(GetParam());
    return make_method(std::get<0>(GetParam()))->solve(*problem, settings);
  }
  /// 300 tolerances of the size of the solution, as of the tests of pairs, and 1000 of FESD-J; and what zeros are located
  /// to, as a part of a step.
  static double allowed(double size) {
    const double factor = std::string(std::get<0>(GetParam())).starts_with("fesd") ? 1000 : 300;
    return (factor * std::get<1>(GetParam()) + 2 * kLocated) * (1 + size);
  }
  static constexpr double kLocated = 1e-9;
};

TEST_P(HiddenSwitches, SeesAPushThatMovesWhatRests) {
  for (const double A : {3.2, 6.0, 30.0}) {
    for (const double w : {0.3, 0.1, 0.03, 0.01, 0.003}) {
      const Pulse push{A, w};
      const Solution s = run(block(push.text(), "0", 0, kRough, 3));
      ASSERT_TRUE(s.succeeded()) << s.message;
      const double start = 1 - push.width(kMu * kG);
      const auto v = [&](double t) { return push.once(t) - push.once(start) - kMu * kG * (t - start); };
      const double stop = std::min(3.0, zero_of(v, 1 + push.width(kMu * kG), 20));
      const double dt = stop - start;
      const double x = push.twice(stop) - push.twice(start) - push.once(start) * dt - 0.5 * kMu * kG * dt * dt;
      EXPECT_NEAR(s.q[0], x, allowed(x)) << "A = " << A << ", w = " << w;
    }
  }
}

TEST_P(HiddenSwitches, SeesAPulseThatLiftsWhatRests) {
  for (const char* contact : {"", kRough}) {
    for (const double A : {10.5, 30.0}) {
      for (const double w : {0.3, 0.1, 0.03, 0.01, 0.003}) {
        const Pulse lift{A, w};
        const double start = 1 - lift.width(kG);
        const auto y = [&](double t) {
          const double dt = t - start;
          return lift.twice(t) - lift.twice(start) - lift.once(start) * dt - 0.5 * kG * dt * dt;
        };
        const double T = 1 + 0.9 * lift.width(kG);  // it rises
        const Solution s = run(block("0", lift.text(), 0, contact, T));
        ASSERT_TRUE(s.succeeded()) << s.message << ", A = " << A << ", w = " << w;
        EXPECT_NEAR(s.q[1], y(T), allowed(0)) << "A = " << A << ", w = " << w;
        ASSERT_FALSE(s.events.empty()) << "A = " << A << ", w = " << w;
        EXPECT_EQ(s.events.front().kind, EventKind::detach);
        EXPECT_NEAR(s.events.front().t, start, 10 * std::get<1>(GetParam()) * w + 2 * kLocated)
            << "A = " << A << ", w = " << w;
      }
    }
  }
}

TEST_P(HiddenSwitches, SeesABeltThatOvertakesWhatSlides) {
  for (const double A : {7.5, 12.0}) {
    for (const double w : {0.3, 0.1, 0.03, 0.01, 0.003}) {
      const Pulse belt{A, w};
      const std::string contact = fmt::format(R"-({}, "vt_drive": ["-({})"])-", kRough, belt.text());
      const std::string scene = block("0", "0", 10, contact, 2);
      if (!make_method(std::get<0>(GetParam()))->supports(read_scene_text(scene, "belt")->info()).ok)
        GTEST_SKIP() << "tableau without a stage at the right end";
      const Solution s = run(scene);
      ASSERT_TRUE(s.succeeded()) << s.message;
      const double a = kMu * kG;
      const double t_1 = zero_of([&](double t) { return 10 - a * t - belt(t); }, 0, 1);
      const double t_2 = zero_of([&](double t) { return 10 - a * t_1 + a * (t - t_1) - belt(t); }, 1, 2);
      const double T = 2, v_1 = 10 - a * t_1, v_2 = v_1 + a * (t_2 - t_1), dt = T - t_2;
      const double x = 0.5 * (10 + v_1) * t_1 + 0.5 * (v_1 + v_2) * (t_2 - t_1) + v_2 * dt - 0.5 * a * dt * dt;
      EXPECT_NEAR(s.q[0], x, allowed(x)) << "A = " << A << ", w = " << w;
      EXPECT_NEAR(s.v[0], v_2 - a * dt, allowed(x)) << "A = " << A << ", w = " << w;
    }
  }
}

/// Without time: a mass on a spring on a plate that moves uniformly, a little more slowly than the mass at its fastest.
/// v = cos(2 t) but for friction of 0.00981 N, whose sign changes twice in each of its periods.
TEST_P(HiddenSwitches, SeesSlipThatTurnsForAMoment) {
  for (const double d : {1.02, 1.1}) {
    const std::string scene = fmt::format(
        R"({{"q0": [0, 0, 0], "v0": [1, 0, {}], "T": 6, "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1e9]],
            "f": ["-4*q[0]", "-9.81", 0],
            "contacts": [{{"name": "plate", "gap": "q[1]", "e": 0, "mu": 0.001, "Jt": [[1, 0, -1]]}}]}})",
        -1 / d);
    // x = m + r sin(2 (t - t_m)) about m = -+ mu g / 4, from one change of sign to the next.
    double t = 0, x = 0, v = 1, sign = 1;
    while (t < 6) {
      const double m = -sign * 0.001 * kG / 4, r = std::hypot(x - m, v / 2), phase = std::atan2(2 * (x - m), v);
      const auto slip = [&](double dt) { return sign * (2 * r * std::cos(2 * dt + phase) + 1 / d); };
      double dt = 1e-4;
      while (t + dt < 6 && slip(dt) > 0) dt += 1e-4;
      dt = t + dt < 6 ? zero_of(slip, dt - 1e-4, dt) : 6 - t;
      x = m + r * std::sin(2 * dt + phase);
      v = 2 * r * std::cos(2 * dt + phase);
      t += dt;
      sign = -sign;
    }
    const Solution s = run(scene);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(s.q[0], x, allowed(1)) << d;
    EXPECT_NEAR(s.v[0], v, allowed(1)) << d;
  }
}

/// Tests that the adapters of SUNDIALS have to pass, too.
class AnyMethod : public HiddenSwitches {};

/// No switch, but an error estimate that compares stages on either side of the pulse sees nothing.
TEST_P(AnyMethod, SeesAPushOnWhatSlidesFreely) {
  const double v_0 = 0.5, T = 3, middle = 5.5 / 16 * T;  // of a span that the force is looked at in
  for (const double A : {6.0, 100.0}) {
    for (const auto& [w, t_0] : std::vector<std::pair<double, double>>{{0.3, 1},
                                                                       {0.03, 1},
                                                                       {0.003, 1},
                                                                       {0.0003, 1},
                                                                       {0.03, middle},
                                                                       {0.003, middle},
                                                                       {0.003, middle + 0.002},
                                                                       {0.0003, middle + 0.0002}}) {
      const Pulse push{A, w, t_0};
      const Solution s = run(block(push.text(), "0", v_0, "", T));
      ASSERT_TRUE(s.succeeded()) << s.message;
      const double v = v_0 + push.once(T) - push.once(0), x = (v_0 - push.once(0)) * T + push.twice(T) - push.twice(0);
      // 1 % of the pulse: estimates of Gauss and Radau are loose where a load begins.
      const double pulse = 0.01 * (push.once(T) - push.once(0));
      EXPECT_NEAR(s.v[0], v, allowed(v) + pulse) << "A = " << A << ", w = " << w;
      EXPECT_NEAR(s.q[0], x, allowed(x) + pulse * T) << "A = " << A << ", w = " << w;
    }
  }
}

/// A ball leaves a wave at a small angle and is back a hundredth of a wave later, in a step that would be long.
TEST_P(AnyMethod, SeesALowBounceOnAWave) {
  for (const double x_0 : {3.5, 4.0}) {
    for (const double rise : {0.1, 0.01, 0.001}) {
      const double slope = 0.1 * std::cos(x_0) + rise;
      const auto gap = [&](double t) { return 0.1 * std::sin(x_0) + slope * t - 0.1 * std::sin(x_0 + t); };
      const Solution s = run(fmt::format(
          R"json({{"q0": [{0}, "0.1*sin({0})"], "v0": [1, "0.1*cos({0})+{1}"], "T": 20, "M": [[1, 0], [0, 1]],
                   "f": [0, 0], "contacts": [{{"name": "wave", "gap": "q[1]-0.1*sin(q[0])", "e": 0.5}}]}})json",
          x_0, rise));
      ASSERT_FALSE(s.events.empty()) << "x_0 = " << x_0 << ", rise = " << rise;
      // It begins as a parabola of curvature 0.1 |sin x_0|, and up to the next crest there is one more zero.
      const double crest = 2.5 * std::numbers::pi - x_0;
      EXPECT_NEAR(s.events.front().t, zero_of(gap, -5 * rise / std::sin(x_0), crest), 1e-5)  // small bounces: 1e-6 high
          << "x_0 = " << x_0 << ", rise = " << rise;
    }
  }
}

std::string test_of_method(const testing::TestParamInfo<std::tuple<const char*, double>>& test) {
  std::string name = fmt::format("{}_{}", std::get<0>(test.param), std::get<1>(test.param));
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

const auto kPulseTolerances = testing::Values(1e-4, 1e-7, 1e-10);
const auto kPulseMethods = testing::Values(
    "event_driven:prince-dormand-8-7", "event_driven:dopri5", "event_driven:dop853", "event_driven:verner-9-8",
    "event_driven:radau-iia:3", "event_driven:radau-iia:5", "fesd_adaptive:radau-iia:3", "fesd_adaptive:radau-iia:4",
    "fesd_adaptive:gauss:3", "fesd_adaptive:gauss:4");
const auto kPulseAdapters = testing::Values("cvode:adams", "cvode:bdf", "ida", "arkode");

INSTANTIATE_TEST_SUITE_P(All, HiddenSwitches, testing::Combine(kPulseMethods, kPulseTolerances), test_of_method);
INSTANTIATE_TEST_SUITE_P(All, AnyMethod, testing::Combine(kPulseMethods, kPulseTolerances), test_of_method);
INSTANTIATE_TEST_SUITE_P(Sundials, AnyMethod, testing::Combine(kPulseAdapters, kPulseTolerances), test_of_method);

}  // namespace
}  // namespace ricochet
