// Contacts that touch without a load, bounces that end an accumulation with friction, and bounces without loss.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

Solution run(const std::string& scene, const std::string& method, int n_steps = 100) {
  const auto problem = read_scene_text(scene, "unloaded");
  Settings settings;
  settings.steps = n_steps;
  settings.tolerance = 1e-10;
  return make_method(method)->solve(*problem, settings);
}

constexpr const char* kMethods[] = {"event_driven", "fesd_adaptive:radau-iia:4", "fesd:radau-iia:3,elements=as_needed",
                                    "fesd:gauss:3,elements=as_needed"};

/// Pressed by k t^p, p > 0: v = 1 - mu k t^(p+1) / (p+1) until the part stops.
TEST(UnloadedContacts, AreClosedByALoadOfAnyOrder) {
  const double mu = 0.5, k = 20;
  for (int p = 1; p <= 4; ++p) {
    const std::string scene = fmt::format(
        R"({{"q0": [0, 0], "v0": [1, 0], "T": 1.5, "M": [[1, 0], [0, 1]], "f": [0, "-{}*t**{}"],
            "contacts": [{{"name": "jaw", "gap": "q[1]", "mu": {}, "Jt": [[1, 0]]}}]}})",
        k, p, mu);
    const double stop = std::pow((p + 1) / (mu * k), 1.0 / (p + 1));
    const double x = stop - mu * k * std::pow(stop, p + 2) / ((p + 1) * (p + 2));
    for (const char* method : kMethods) {
      const Solution s = run(scene, method);
      ASSERT_TRUE(s.succeeded()) << method << " " << p << ": " << s.message;
      EXPECT_NEAR(s.q[0], x, 1e-8) << method << " " << p << ": 100 tolerances, or the error of 100 steps";
      EXPECT_NEAR(s.v[0], 0, 1e-12) << method << " " << p << ": it sticks";
    }
  }
}

/// Lifted by t^p: q = t^(p+2) / ((p+1) (p+2)).
TEST(UnloadedContacts, AreOpenedByALoadOfAnyOrder) {
  for (int p = 1; p <= 7; ++p) {
    const std::string scene = fmt::format(
        R"({{"q0": [0], "v0": [0], "T": 2, "M": [[1]], "f": ["t**{}"], "contacts": [{{"name": "floor", "gap": "q[0]"}}]}})",
        p);
    for (const char* method : {"event_driven", "fesd:radau-iia:3,elements=as_needed", "fesd:gauss:3,elements=as_needed",
                               "fesd_adaptive:radau-iia:3", "fesd_adaptive:radau-iia:4", "fesd_adaptive:gauss:4"}) {
      const Solution s = run(scene, method);
      ASSERT_TRUE(s.succeeded()) << method << " " << p << ": " << s.message;
      EXPECT_NEAR(s.q[0], std::pow(2, p + 2) / ((p + 1) * (p + 2)), 1e-8) << method << " " << p << ": 100 tolerances";
    }
  }
}

/// Four balls that touch fall along their row; no force acts between them.
TEST(UnloadedContacts, BodiesThatMoveSideBySideStayTogether) {
  const std::string scene = R"({"q0": [0.3, 0.5, 0.7, 0.9], "v0": [0.2, 0.2, 0.2, 0.2], "T": 2,
    "M": [[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 3]], "f": ["-9.81", "-19.62", "-4.905", "-29.43"],
    "contacts": [{"name": "a", "gap": "q[1]-q[0]-0.2", "e": 0.8}, {"name": "b", "gap": "q[2]-q[1]-0.2", "e": 0.8},
                 {"name": "c", "gap": "q[3]-q[2]-0.2", "e": 0.8}]})";
  for (const char* method : kMethods) {
    const Solution s = run(scene, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(s.q[k], 0.3 + 0.2 * k + 0.4 - 2 * 9.81, 1e-11) << method << ": rounding of 100 steps";
  }
}

/// The bounces end before the slip does. It slides v^2 / (2 mu g) + mu h whatever e is, since every impulse and force has its friction.
TEST(ClosedBounces, HaveTheirFriction) {
  for (const double e : {0.2, 0.4, 0.6}) {
    const std::string scene = fmt::format(
        R"({{"q0": [0, 1], "v0": [4, 0], "T": 6, "M": [[1, 0], [0, 1]], "f": [0, "-9.81"],
            "contacts": [{{"name": "floor", "gap": "q[1]", "e": {}, "mu": 0.2, "Jt": [[1, 0]]}}]}})",
        e);
    const Solution s = run(scene, "event_driven");
    ASSERT_TRUE(s.succeeded()) << e << ": " << s.message;
    EXPECT_NEAR(s.q[0], 16 / (2 * 0.2 * 9.81) + 0.2, 1e-11) << e << ": the square of the last bounce's velocity";
  }
}

/// Parabolas of 2 sqrt(2 h / g); the flights are shorter than the steps.
TEST(ClosedBounces, AreNotThoseWithoutLoss) {
  const double h = 9.3, g = 9.8, T = 1000, fall = std::sqrt(2 * h / g);
  const std::string scene =
      R"({"q0": [9.3], "v0": [0], "T": 1000, "M": [[1]], "f": ["-9.8"], "contacts": [{"name": "floor", "gap": "q[0]", "e": 1}]})";
  const double t = std::fmod(T + fall, 2 * fall) - fall;
  for (const char* method : {"fesd:radau-iia:3,elements=as_needed", "fesd:gauss:3,elements=as_needed"}) {
    const Solution s = run(scene, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[0], h - g / 2 * t * t, 1e-8) << method << ": rounding of 363 bounces";
  }
}

/// Gauss closes the last bounces of an accumulation. What is left of their velocity must not open the contact again.
TEST(ClosedBounces, EndInGauss) {
  struct Start {
    double q_0, q_1, v_0, v_1;
    int n_steps;
  };
  for (const Start& at :
       {Start{1.03, 1.98, 0.09, 0.44, 50}, Start{1.02, 1.98, -0.06, -0.24, 50}, Start{0.94, 2, 0, 0.3, 256}}) {
    const auto problem = make_problem("two_balls_spring");
    problem->set_initial_state(Vector{{at.q_0, at.q_1}}, Vector{{at.v_0, at.v_1}});
    Settings settings;
    settings.steps = at.n_steps;
    settings.tolerance = 1e-10;
    const Solution s = make_method("fesd:gauss:4,elements=as_needed")->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << at.q_0 << ": " << s.message;
    const Solution exact = make_method("event_driven")->solve(*problem, settings);
    ASSERT_TRUE(exact.succeeded()) << exact.message;
    // The flights that are left out take 2 h v+ / (g kappa), and both balls are as far from where they were.
    EXPECT_LE((s.q - exact.q).cwiseAbs().maxCoeff(), 0.05 * problem->info().end_time / at.n_steps) << at.q_0;
  }
}

}  // namespace
}  // namespace ricochet
