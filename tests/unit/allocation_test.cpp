// Counts heap allocations: a time step must not make any. A binary of its own, since it replaces malloc.
#include <gtest/gtest.h>

#include "bench/measure/allocations.h"
#include "methods/control/exploration.h"
#include "methods/control/shooting/linearised_interval.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "reference/contact_dynamics.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

struct Count {
  std::int64_t allocations;
  std::size_t events;
};

Count count(const Problem& problem, const std::string& spec, int steps) {
  const auto method = make_method(spec);
  Settings settings;
  settings.steps = steps;
  method->solve(problem, settings);  // the first run of a thread sizes the scratch of the problem's programs
  Solution solution;
  const std::int64_t allocations = allocations_of([&] { solution = method->solve(problem, settings); }).count;
  EXPECT_TRUE(solution.succeeded()) << spec << ": " << solution.message;
  return {allocations, solution.events.size()};
}

/// An event that is recorded keeps five vectors, and the list of events may grow.
constexpr long kPerEvent = 6;

TEST(Allocations, AreCounted) {
  EXPECT_EQ(allocations_of([] { EXPECT_EQ(Eigen::VectorXd(100).size(), 100); }).count, 1);
}

TEST(Allocations, HaveAPeak) {
  constexpr std::int64_t n = 100'000, bytes = n * sizeof(double);
  const auto twice = [&] {  // one after the other
    for (int k = 0; k < 2; ++k) EXPECT_EQ(Eigen::VectorXd::Zero(n).eval().size(), n);
    return 0.0;
  };
  EXPECT_GE(peak_bytes_of(twice), bytes);
  EXPECT_LT(peak_bytes_of(twice), 1.5 * bytes);
  EXPECT_TRUE(std::isnan(peak_bytes_of([] { return 1.0; }))) << "of a run in another process nothing is seen";
}

struct AllocationCase {
  const char *problem, *method;
};

class StepWithoutAllocation : public testing::TestWithParam<AllocationCase> {};

/// What a run allocates depends on its events, not on its steps.
TEST_P(StepWithoutAllocation, AllocatesTheSameForTwiceTheSteps) {
  const auto problem = make_problem(GetParam().problem);
  const Count few = count(*problem, GetParam().method, 400), many = count(*problem, GetParam().method, 800);
  const long more_events = std::max(0L, static_cast<long>(many.events) - static_cast<long>(few.events));
  EXPECT_LE(many.allocations, few.allocations + kPerEvent * more_events)
      << GetParam().method << " on " << GetParam().problem;
}

INSTANTIATE_TEST_SUITE_P(
    Methods, StepWithoutAllocation,
    testing::Values(
        AllocationCase{"two_balls_spring", "fesd:gauss:4"}, AllocationCase{"two_balls_spring", "fesd:radau-iia:3"},
        AllocationCase{"two_balls_spring", "fesd:radau-iia:2,elements=as_needed"},
        AllocationCase{"pendulum_wall", "fesd:gauss:3"}, AllocationCase{"bouncing_ball", "fesd:radau-iia:2"},
        AllocationCase{"two_balls_spring", "irk:gauss:4,contacts=ignored"},
        AllocationCase{"pendulum_wall", "irk:radau-iia:3,contacts=ignored"},
        AllocationCase{"bouncing_ball", "moreau_jean"}, AllocationCase{"pendulum_wall", "moreau_jean"},
        AllocationCase{"sliding_block", "moreau_jean"}, AllocationCase{"pendulum_wall_cartesian", "fesd:radau-iia:3"},
        AllocationCase{"pendulum_wall_cartesian", "moreau_jean"}, AllocationCase{"slider_crank_stop", "anitescu_potra"},
        AllocationCase{"bouncing_ball", "anitescu_potra"}, AllocationCase{"sliding_block", "anitescu_potra"},
        AllocationCase{"stacked_blocks", "moreau_jean,solver=pgs"},
        AllocationCase{"stacked_blocks", "moreau_jean,solver=newton"},
        AllocationCase{"stacked_blocks", "moreau_jean,solver=interior_point"},
        AllocationCase{"stacked_blocks", "moreau_jean,solver=admm"},
        AllocationCase{"ball_3d", "moreau_jean,solver=admm"},
        AllocationCase{"stacked_blocks", "moreau_jean,solver=staggered"}, AllocationCase{"ball_3d", "moreau_jean"},
        AllocationCase{"ball_3d", "moreau_jean,solver=newton,projection=on"},
        AllocationCase{"pendulum_wall_cartesian", "moreau_jean,implicit=full"},
        AllocationCase{"stacked_blocks", "stewart_trinkle"},
        AllocationCase{"stacked_blocks", "anitescu_convex,solver=pgs"},
        AllocationCase{"two_balls_spring", "schatzman_paoli"}, AllocationCase{"two_balls_spring", "generalized_alpha"},
        AllocationCase{"two_balls_spring", "anitescu_potra,implicit=linear"},
        AllocationCase{"two_balls_spring", "penalty"}),
    [](const auto& test) { return test_name(std::string(test.param.problem) + "_" + test.param.method); });

INSTANTIATE_TEST_SUITE_P(
    Engines, StepWithoutAllocation,
    testing::Values(AllocationCase{"two_balls_spring", "soft_step"},
                    AllocationCase{"pendulum_wall_cartesian", "soft_step"}, AllocationCase{"ball_3d", "soft_step"},
                    AllocationCase{"stacked_blocks", "soft_step"}, AllocationCase{"ball_3d", "xpbd"},
                    AllocationCase{"pendulum_wall_cartesian", "xpbd"},
                    AllocationCase{"stacked_blocks", "xpbd,iterations=3"}, AllocationCase{"stacked_blocks", "sap"},
                    AllocationCase{"block_on_ramp_3d", "sap"}, AllocationCase{"sliding_block", "sap,theta=0.5"}),
    [](const auto& test) { return test_name(std::string(test.param.problem) + "_" + test.param.method); });

TEST(Allocations, OfAPersistentContact) {
  const auto resting = make_problem("bouncing_ball", {{"e", 0}});
  const Count few = count(*resting, "fesd:radau-iia:3", 400), many = count(*resting, "fesd:radau-iia:3", 800);
  EXPECT_EQ(many.allocations, few.allocations);
}

struct Step {
  const char *method, *scene;
};

/// The same of a method that chooses its steps: a sharper tolerance makes more of them.
TEST(StepsOfATolerance, AllocateNothing) {
  for (const auto& [spec, scene] :
       {Step{"event_driven", "two_balls_spring"}, Step{"event_driven", "pendulum_wall"},
        Step{"event_driven", "slider_crank_stop"}, Step{"event_driven", "belt_oscillator"},
        Step{"event_driven:radau-iia:3", "two_balls_spring"}, Step{"event_driven:radau-iia:5", "two_balls_spring"},
        Step{"event_driven:radau-iia:3", "slider_crank_stop"}, Step{"event_driven:radau-iia:5", "belt_oscillator"}}) {
    const auto method = make_method(spec);
    const auto problem = make_problem(scene);
    std::int64_t steps[2];
    Count counts[2];
    const double tolerances[]{1e-6, 1e-10};
    for (int k = 0; k < 2; ++k) {
      Settings settings;
      settings.tolerance = tolerances[k];
      method->solve(*problem, settings);
      Solution solution;
      const std::int64_t allocations = allocations_of([&] { solution = method->solve(*problem, settings); }).count;
      ASSERT_TRUE(solution.succeeded()) << spec << " on " << scene << ": " << solution.message;
      counts[k] = {allocations, solution.events.size()};
      steps[k] = solution.counters.steps;
    }
    EXPECT_GT(steps[1], steps[0] + 10) << spec << " on " << scene;
    ASSERT_EQ(counts[1].events, counts[0].events) << spec << " on " << scene;
    EXPECT_EQ(counts[1].allocations, counts[0].allocations) << spec << " on " << scene;
  }
}

struct ModeCase {
  const char* problem;
  ContactMode mode;  ///< of the first contact that is not bilateral; the others are open
};

class RightHandSideWithoutAllocation : public testing::TestWithParam<ModeCase> {};

TEST_P(RightHandSideWithoutAllocation, AfterTheFirstCall) {
  const auto problem = make_problem(GetParam().problem);
  reference::ContactDynamics dynamics(*problem);
  auto modes = dynamics.modes();
  modes[problem->info().unilateral.front()] = GetParam().mode;
  dynamics.set_modes(modes);
  const auto& info = problem->info();
  Vector a(info.n_q), lambda_n(info.n_c()), lambda_t(info.n_lambda_t);
  const Vector v = info.v0.array() + 0.5;  // so that friction in space has a direction
  const auto evaluate = [&] {
    return dynamics.acceleration(info.q0.data(), v.data(), a.data(), lambda_n.data(), lambda_t.data());
  };
  ASSERT_TRUE(evaluate());
  const auto work = [&] {
    for (int k = 0; k < 10; ++k) evaluate();
  };
  EXPECT_EQ(allocations_of(work).count, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Modes, RightHandSideWithoutAllocation,
    testing::Values(ModeCase{"two_balls_spring", ContactMode::open}, ModeCase{"two_balls_spring", ContactMode::closed},
                    ModeCase{"double_pendulum_wall", ContactMode::closed},
                    ModeCase{"slider_crank_stop", ContactMode::open},
                    ModeCase{"belt_oscillator", ContactMode::slip_positive},
                    ModeCase{"rocking_block", ContactMode::stick}, ModeCase{"ball_3d", ContactMode::slip},
                    ModeCase{"box_3d", ContactMode::stick}, ModeCase{"box_3d", ContactMode::slip}),
    [](const auto& test) { return test_name(std::string(test.param.problem) + "_" + to_string(test.param.mode)); });

class LinearisationWithoutAllocation : public testing::TestWithParam<const char*> {};

// Through impacts, switches and redundant contacts, which have matrices of several sizes.
TEST_P(LinearisationWithoutAllocation, AfterTheFirstCall) {
  const auto problem = make_control_problem(GetParam());
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  const ProblemInfo& info = problem->plant->info();
  const ExplorationResult found = explore(*problem, tableau, problem->n_fe, {.rounds = 4, .seed = 3});
  PlantRunner runner(*problem, tableau);
  MotionLineariser lineariser(runner);
  PlantMotion motion;
  runner.run(info.q0, info.v0, found.u, info.end_time / problem->n_intervals, motion);
  ASSERT_TRUE(motion.succeeded()) << motion.message;
  ASSERT_EQ(lineariser.linearise(motion), "");
  EXPECT_EQ(allocations_of([&] { lineariser.linearise(motion); }).count, 0);

  // Elements of equal length and modes share a matrix where the plant is linear.
  long elements = 0;
  for (const FesdStep& step : motion.steps) elements += step.n_elements;
  const long before = lineariser.factorisations();
  ASSERT_EQ(lineariser.linearise(motion), "");
  const long factorisations = lineariser.factorisations() - before;
  EXPECT_LE(factorisations, elements) << "at most one of an element";
  if (info.id == "two_carts") {
    EXPECT_LE(factorisations, elements / 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Control, LinearisationWithoutAllocation,
                         testing::Values("two_carts", "cart_pole_friction", "push_box_goal", "hopper", "discs",
                                         "three_boxes"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace ricochet
