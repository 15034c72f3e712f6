// Sensitivities of event-driven methods: against those of FESD-J, which have other equations, and against differences.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/measure/sensitivities.h"
#include "methods/registry.h"
#include "problems/control/replay_problem.h"
#include "problems/variables.h"
#include "reference/agreement.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// The parameters, and where nothing touches or is joined at t = 0 the initial values.
std::vector<std::string> differentiable_variables(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  const bool is_free = info.contacts.empty() || (!info.has_bilateral() && problem.gap(info.q0).minCoeff() > 0);
  std::vector<std::string> names;
  for (const auto& [name, value] : variables(info)) {
    const bool is_parameter = name.starts_with("param:");
    if (is_parameter ? !(name[6] == 'e' && value == 0) : is_free) names.push_back(name);  // e >= 0: one-sided
  }
  return names;
}

Solution solve_event_driven(const Problem& problem, double tolerance, const std::vector<std::string>& names) {
  Settings settings;
  settings.tolerance = tolerance;
  settings.sensitivities = names;
  return make_method("event_driven")->solve(problem, settings);
}

Solution solve_fesd(const Problem& problem, const std::vector<std::string>& names) {
  Settings settings;
  settings.steps = 1000;
  settings.sensitivities = names;
  return make_method("fesd:radau-iia:4,elements=as_needed")->solve(problem, settings);
}

struct SceneCase {
  const char* scene;
  double error;
};

class EventSensitivitiesOfScenes : public testing::TestWithParam<SceneCase> {};

TEST_P(EventSensitivitiesOfScenes, AreThoseOfFesd) {
  const auto problem = make_problem(GetParam().scene);
  const auto names = differentiable_variables(*problem);
  const Solution s = solve_event_driven(*problem, 1e-12, names), fesd = solve_fesd(*problem, names);
  ASSERT_TRUE(s.succeeded() && fesd.succeeded()) << s.message << fesd.message;
  EXPECT_LE(reference::sensitivity_difference(s, fesd), GetParam().error);
}

// Three times what was measured, relative to the size of a column or 1, and at least ten times the tolerance: rounding
// of a thousand steps is up to it, and another one on each processor. The ball comes to rest by bounces, of which each method follows its own number.
INSTANTIATE_TEST_SUITE_P(Scenes, EventSensitivitiesOfScenes,
                         testing::Values(SceneCase{"ball_3d", 1e-11}, SceneCase{"ball_in_box", 1e-11},
                                         SceneCase{"belt_oscillator", 1e-11}, SceneCase{"block_on_ramp_3d", 1e-11},
                                         SceneCase{"disc_in_chute", 1e-11}, SceneCase{"double_pendulum_wall", 3e-11},
                                         SceneCase{"falling_rod", 1e-11}, SceneCase{"kane_pendulum", 3e-11},
                                         SceneCase{"oblique_impact", 1e-11}, SceneCase{"pendulum_wall", 1e-11},
                                         SceneCase{"pendulum_wall_cartesian", 1e-11}, SceneCase{"rocking_block", 1e-11},
                                         SceneCase{"shaken_table", 2e-9}, SceneCase{"slider_crank_stop", 1e-11},
                                         SceneCase{"stacked_blocks", 1e-11}, SceneCase{"woodpecker_toy", 1e-9}),
                         [](const auto& test) { return test_name(test.param.scene); });

/// Of the numbers that the run itself returns, at the tightest tolerance.
TEST(EventSensitivities, AreTheDerivativesOfTheMotion) {
  // What differences lose: three times what was measured.
  for (const auto& [scene, lost] : {std::pair{"belt_oscillator", 3e-8},
                                    {"oblique_impact", 3e-8},
                                    {"pendulum_wall_cartesian", 3e-8},
                                    {"slider_crank_stop", 4e-7}}) {
    const auto problem = make_problem(scene);
    const auto method = make_method("event_driven");
    Settings settings;
    settings.tolerance = 1e-13;
    settings.sensitivities = differentiable_variables(*problem);
    const Solution s = method->solve(*problem, settings),
                   differences = solve_with_differences(*method, *problem, settings, 1e-3);
    ASSERT_TRUE(s.succeeded() && differences.succeeded()) << scene << s.message << differences.message;
    EXPECT_LE(reference::sensitivity_difference(s, differences), lost) << scene;
  }
}

/// Slip in space that stops and begins again along another direction.
TEST(EventSensitivities, OfSlipInSpaceThatBeginsFromRest) {
  const auto problem = read_scene_file(test_data("dragged_block_3d.json"));
  const std::vector<std::string> names{"param:mu", "param:k", "param:v_x0", "param:V_Y0"};
  const Solution fesd = solve_fesd(*problem, names);
  ASSERT_TRUE(fesd.succeeded()) << fesd.message;
  double last = 1;
  for (const double tolerance : {1e-6, 1e-8, 1e-10, 1e-12}) {
    const Solution s = solve_event_driven(*problem, tolerance, names);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_EQ(kinds(s), kinds(fesd));
    const double error = reference::sensitivity_difference(s, fesd);
    EXPECT_LE(error, last) << tolerance;
    last = error;
  }
  EXPECT_LE(last, 1e-8);
}

/// A crank with bilateral constraints that rubs, stops and slips back.
TEST(EventSensitivities, OfAConstrainedMotionWithFriction) {
  const auto crank = read_scene_file(test_data("crank_with_friction.json"));
  const std::vector<std::string> names{"param:mu", "param:m_3", "param:l_1", "param:theta0"};
  const Solution s = solve_event_driven(*crank, 1e-11, names), fesd = solve_fesd(*crank, names);
  ASSERT_TRUE(s.succeeded() && fesd.succeeded()) << s.message << fesd.message;
  EXPECT_EQ(kinds(s), kinds(fesd));
  EXPECT_LE(reference::sensitivity_difference(s, fesd), 1e-9);
}

/// Of one interval of a control problem, in which the first cart bumps into the second.
TEST(EventSensitivities, OfControls) {
  const auto carts = make_control_problem("two_carts");
  ReplayProblem plant(*carts);
  const ProblemInfo& info = carts->plant->info();
  plant.restart(info.q0, info.v0, Vector::Constant(info.n_u, 6), 2);
  const std::vector<std::string> names{"param:" + ReplayProblem::control_parameter(0), "q0:0", "v0:1"};
  const Solution s = solve_event_driven(plant, 1e-12, names), fesd = solve_fesd(plant, names);
  ASSERT_TRUE(s.succeeded() && fesd.succeeded()) << s.message << fesd.message;
  ASSERT_GE(s.events.size(), 1u);
  EXPECT_LE(reference::sensitivity_difference(s, fesd), 1e-11) << "rounding of a thousand steps";
}

/// Two balls on guides of their own land at once, and beside it they do not: but each by itself.
TEST(EventSensitivities, HaveNoneWhereContactsCloseTogether) {
  const auto balls = read_scene_file(test_data("simultaneous_balls.json"));
  EXPECT_TRUE(solve_event_driven(*balls, 1e-8, {"param:g"}).succeeded()) << "both move alike";
  const Solution s = solve_event_driven(*balls, 1e-8, {"q0:0"});
  EXPECT_EQ(s.status, Status::infeasible);
  EXPECT_NE(s.message.find("touches at this instant, but beside it at another one"), std::string::npos) << s.message;
}

TEST(EventSensitivities, HaveNoneAtARestingContactThatIsMovedOff) {
  const auto block = make_problem("sliding_block");
  const Solution s = solve_event_driven(*block, 1e-8, {"q0:1"});
  EXPECT_EQ(s.status, Status::infeasible);
  EXPECT_NE(s.message.find("there is no derivative"), std::string::npos) << s.message;
}

/// A disc without friction that would rise 1e-10 m above the roof.
std::unique_ptr<Problem> grazing_disc() {
  return make_problem("ball_in_box", {{"mu", 0},
                                      {"omega0", 0},
                                      {"x0", 0.5},
                                      {"v_x0", 0},
                                      {"y0", 0.4},
                                      {"v_y0", std::sqrt(2 * 9.81 * (0.3 + 1e-10))},
                                      {"g", 9.81},
                                      {"H", 0.8},
                                      {"R", 0.1},
                                      {"duration", 0.4}});
}

/// The zeros of its gap are 9e-6 s apart in a step of a tenth of a second.
TEST(EventSensitivities, GrazingIsFound) {
  const auto disc = grazing_disc();
  const double rise = std::sqrt(2 * 9.81 * (0.3 + 1e-10)) / 9.81, before = std::sqrt(2e-10 / 9.81);
  for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
    const Solution s = solve_event_driven(*disc, tolerance, {});
    ASSERT_TRUE(s.succeeded()) << tolerance << ": " << s.message;
    ASSERT_FALSE(s.events.empty()) << tolerance;
    // The gap of the parabola is known to a few roundings of 0.7 m; its slope is 4.4e-5 m/s.
    EXPECT_NEAR(s.events[0].t, rise - before, 1e-10) << tolerance;
  }
}

TEST(EventSensitivities, HaveNoneAfterGrazing) {
  const auto disc = grazing_disc();
  const Solution s = solve_event_driven(*disc, 1e-8, {"v0:1"});
  EXPECT_EQ(s.status, Status::infeasible);
  EXPECT_NE(s.message.find("grazes"), std::string::npos) << s.message;
}

}  // namespace
}  // namespace ricochet
