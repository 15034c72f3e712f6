// A rod that rests on its tip turns about it until its other end falls on the ground. The tip has drifted from the
// ground by the error of the steps, not by rounding, and takes its part of the impulse all the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

constexpr const char* kRod = R"json({
  "params": {"l": "0.25", "a": "0.27"}, "q0": [0, "l*sin(a)", "a"], "v0": [0.07, 0, 0], "T": 0.16,
  "M": [[1, 0, 0], [0, 1, 0], [0, 0, "l**2/3"]], "f": [0, -9.81, 0],
  "contacts": [{"name": "tip", "gap": "q[1]-l*sin(q[2])", "e": 0},
               {"name": "tail", "gap": "q[1]+l*sin(q[2])", "e": 0.6, "mu": 1, "Jt": [[1, 0, "-l*sin(q[2])"]]}]})json";

class ImpactBesideRest : public testing::TestWithParam<std::tuple<const char*, double>> {};

TEST_P(ImpactBesideRest, KeepsTheTipOnTheGround) {
  const auto [method, tolerance] = GetParam();
  const auto problem = read_scene_text(kRod, "rod");
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = Recording::events;
  const Solution s = make_method(method)->solve(*problem, settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.events.size(), 1U);
  const auto& impact = s.events.front();
  EXPECT_EQ(impact.kind, EventKind::impact);
  EXPECT_EQ(problem->info().contacts[impact.contact].name, "tail");
  // The rod is level then: y' - l theta' of the tip stays zero, and y' + l theta' of the tail is thrown back.
  const double l = 0.25, allowed = 100 * tolerance;  // errors of a step add up
  const auto rate = [&](double sign, const Vector& v) { return v[1] + sign * l * v[2]; };
  EXPECT_NEAR(rate(-1, impact.v_plus), 0, allowed);
  EXPECT_NEAR(rate(1, impact.v_plus), -0.6 * rate(1, impact.v_minus), allowed);
  // A quarter of the mass moves with an end, and Lambda_tip is half of Lambda_tail where the tip stays at rest.
  const double alone = -rate(1, impact.v_minus) * 1.6 / 4;
  EXPECT_NEAR(impact.Lambda_n[1], alone * 4 / 3, allowed);
  EXPECT_NEAR(impact.Lambda_n[0], alone * 2 / 3, allowed);
}

INSTANTIATE_TEST_SUITE_P(All, ImpactBesideRest,
                         testing::Combine(testing::Values("event_driven", "event_driven:radau-iia:5",
                                                          "fesd_adaptive:radau-iia:4", "fesd_adaptive:radau-iia:3",
                                                          "cvode:adams", "cvode:bdf", "ida", "arkode"),
                                          testing::Values(1e-6, 1e-8, 1e-10)),
                         [](const auto& test) {
                           std::string name = fmt::format("{}_{:g}", std::get<0>(test.param), std::get<1>(test.param));
                           for (char& c : name) {
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace ricochet
