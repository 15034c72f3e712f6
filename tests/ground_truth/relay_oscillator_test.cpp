// The period of a relay oscillator, and the resting place of an oscillator with Coulomb friction, to 1e-10 by FESD-J,
// event_driven and the numerical reference, which share no formulas.
//
// A relay oscillator x'' = -x - F sign(x) from x = A, v = 0 swings about -F with the radius A + F while x > 0, so that it
// crosses x = 0 after arccos(F / (A + F)), and by symmetry its period is
//
//   T_p = 4 arccos(F / (A + F))                                                                                    (1)
//
// After n periods it is at x = A again with v = -(A + F) (t - n T_p): v shows the error of n T_p.
//
// With friction F and stiffness k, half swings are cosines about F/k and -F/k. So |x| at the turns is A, A - 2 F/k, ...,
// until it is at most F/k, where the mass stays.                                                                    (2)
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/agreement.h"
#include "reference/proven.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kGoal = 1e-10;  // [s], [m], [m/s]

// Tolerances are of a step. Errors of fesd_adaptive add up to some tens of them.
constexpr MethodRun kOscillatorRuns[] = {{"fesd_adaptive:radau-iia:4", 0, 1e-13},
                                         {"fesd:radau-iia:4", 300, 0},
                                         {"fesd:gauss:4", 300, 0},
                                         {"event_driven", 0, 1e-13}};

TEST(RelayOscillator, HasItsPeriod) {
  constexpr double F = 0.4, A = 1.05;
  constexpr int kPeriods = 5;
  const double period = 4 * std::acos(F / (A + F));  // (1)
  for (const char* force : {"-q[0]-F*sign(q[0])", "-q[0]-if(q[0]<0, -F, F)"}) {
    const auto problem = read_scene_text(
        fmt::format(
            R"({{"params": {{"F": "{}"}}, "q0": ["{}"], "v0": ["0"], "T": "{:.17g}", "M": [["1"]], "f": ["{}"]}})", F,
            A, kPeriods * period, force),
        "scene");
    const auto expect_period = [&](const Solution& s, const std::string& who) {
      ASSERT_TRUE(s.succeeded()) << who << ": " << s.message;
      EXPECT_LE(std::abs(s.v[0]) / (A + F) / kPeriods, kGoal) << who << ": error of the period";
      EXPECT_LE(std::abs(s.q[0] - A), kGoal) << who;
    };
    for (const MethodRun& how : kOscillatorRuns) expect_period(run_as(*problem, how), how.method);
    expect_period(reference::make_reference(*problem).solution, "the reference by CVODE");
    expect_period(reference::truth_of(*problem).solution, "the reference");
  }
}

TEST(CoulombOscillator, HasItsRestingPlace) {
  const auto problem = read_scene_file(test_data("coulomb_oscillator.json"));
  double place = 1.05;                                                           // A of the file, with F = 1 and k = 10
  while (std::abs(place) > 0.1) place = place > 0 ? 0.2 - place : -0.2 - place;  // (2)
  const auto expect_rest = [&](const Solution& s, const std::string& who) {
    ASSERT_TRUE(s.succeeded()) << who << ": " << s.message;
    EXPECT_LE(std::abs(s.q[0] - place), kGoal) << who;
    EXPECT_LE(std::abs(s.v[0]), kGoal) << who;
  };
  for (const MethodRun& how : kOscillatorRuns) expect_rest(run_as(*problem, how), how.method);
  expect_rest(reference::make_reference(*problem).solution, "the reference by CVODE");
  expect_rest(reference::truth_of(*problem).solution, "the reference");
}

}  // namespace
}  // namespace ricochet
