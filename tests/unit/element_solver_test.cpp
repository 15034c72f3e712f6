#include "methods/elements/element_solver.h"

#include <gtest/gtest.h>

#include "methods/elements/switch_solver.h"
#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

TEST(ElementSolver, FreeFallIsExact) {
  // q is a polynomial of degree 2, v of degree 1: every tableau of order >= 2 reproduces them.
  const auto p = make_problem("bouncing_ball", {{"height", 100}});
  for (const char* tableau : {"gauss:1", "gauss:3", "radau-iia:2", "radau-iia:9", "radau-ia:2", "lobatto-iiia:2",
                              "lobatto-iiib:3", "lobatto-iiic:3"}) {
    Settings settings;
    settings.steps = 7;
    const Solution s = make_method("irk:" + std::string(tableau) + ",contacts=ignored")->solve(*p, settings);
    EXPECT_NEAR(s.q[0], 100 - 0.5 * 9.81 * 4, 100 * 4e-16 * 7) << tableau << ": one rounding of q per step";
    EXPECT_NEAR(s.v[0], -9.81 * 2, 20 * 4e-16 * 7) << tableau;
  }
}

TEST(ElementSolver, CountsItsWork) {
  const auto p = make_problem("bouncing_ball", {{"height", 100}});
  Settings settings;
  settings.steps = 5;
  const Solution s = make_method("irk:gauss:3,contacts=ignored")->solve(*p, settings);
  // In closed form each element is one solution: the force is evaluated for the map, and nothing is factorised.
  EXPECT_EQ(s.counters.steps, 5);
  EXPECT_EQ(s.counters.inner_iterations, 5);
  EXPECT_EQ(s.counters.linear_solves, 5);
  EXPECT_EQ(s.counters.force_evaluations, 1);
  EXPECT_EQ(s.counters.matrix_factorizations, 0);
  EXPECT_EQ(s.counters.jacobian_evaluations, 0);
}

TEST(ElementSolver, CountsTheWorkOfNewtonsMethod) {
  const auto p = make_problem("bouncing_ball", {{"height", 100}});
  Counters counters;
  ElementSystem elements(*p, make_tableau("gauss", 3), counters, FrictionPolygon(), ElementSystem::Form::newton);
  ElementSolver solver(elements, 1e-13);
  Element stages;
  stages.resize(p->info(), 3);
  stages.q0[0] = 100;
  stages.h = 0.1;
  ASSERT_EQ(solver.solve(stages), ElementSolver::Result::converged);
  // A guess of zero accelerations is corrected, and once more what that left. Three force evaluations each.
  EXPECT_EQ(counters.inner_iterations, 2);
  EXPECT_EQ(counters.force_evaluations, 3 * 2);
  EXPECT_EQ(counters.linear_solves, 2);
  ASSERT_EQ(solver.solve(stages), ElementSolver::Result::converged);
  // The accelerations are right from then on: one correction says so. One Newton matrix for all.
  EXPECT_EQ(counters.inner_iterations, 3);
  EXPECT_EQ(counters.matrix_factorizations, 1);
  EXPECT_EQ(counters.jacobian_evaluations, 3);
}

class Switches : public testing::Test {
 protected:
  Counters counters;
  std::unique_ptr<Problem> ball = make_problem("bouncing_ball", {{"height", 1}});
};

TEST_F(Switches, FindTheImpactTimeOfAFall) {
  const double exact = std::sqrt(2 * (1 - 0.1) / 9.81);
  for (const char* family : {"gauss", "radau-iia"}) {
    for (int elements = 1; elements <= 3; ++elements) {
      ElementSystem system(*ball, make_tableau(family, 2), counters);
      SwitchSolver solver(system, 1e-14);
      std::vector<Element> run(3);
      for (auto& stages : run) stages.resize(ball->info(), 2);
      run[0].q0[0] = 1;
      run[0].h = 0.3 / elements;
      const auto result = solver.solve(std::span(run).first(elements), {.contact = 0}, 1.0);
      ASSERT_EQ(result, SwitchSolver::Result::converged);
      EXPECT_NEAR(elements * run[0].h, exact, 4e-16) << family << ": Newton to the last rounding";
      EXPECT_NEAR(ball->gap(run[elements - 1].q1)[0], 0, 2e-16);
      for (int m = 1; m < elements; ++m) EXPECT_EQ(run[m].h, run[0].h) << "elements of a run are equally long";
    }
  }
}

TEST_F(Switches, SkipTheContactAtTheLeftEnd) {
  // Thrown up from the ground: the gap is zero at both ends.
  ElementSystem elements(*ball, make_tableau("radau-iia", 2), counters);
  SwitchSolver solver(elements, 1e-14);
  std::vector<Element> run(1);
  run[0].resize(ball->info(), 2);
  run[0].q0[0] = 0.1;
  run[0].v0[0] = 2;
  run[0].h = 0.1;
  ASSERT_EQ(solver.solve(run, {.contact = 0, .zeros_at_start = 1}, 1.0), SwitchSolver::Result::converged);
  EXPECT_NEAR(run[0].h, 2 * 2 / 9.81, 1e-15);
}

TEST_F(Switches, RefuseARootOutsideTheStep) {
  ElementSystem elements(*ball, make_tableau("gauss", 2), counters);
  SwitchSolver solver(elements, 1e-14);
  std::vector<Element> run(1);
  run[0].resize(ball->info(), 2);
  run[0].q0[0] = 1;
  run[0].h = 0.1;
  EXPECT_EQ(solver.solve(run, {.contact = 0}, 0.2), SwitchSolver::Result::left_interval);
}

TEST(ClosedContact, CarriesTheLoad) {
  const auto p = make_problem("bouncing_ball", {{"height", 0.1}, {"m", 3}});
  Counters counters;
  ElementSystem elements(*p, make_tableau("radau-iia", 3), counters);
  ElementSolver solver(elements, 1e-14);
  Element stages;
  stages.resize(p->info(), 3);
  stages.q0[0] = 0.1;
  stages.modes[0] = ContactMode::closed;
  for (const double h : {1e-1, 1e-3, 1e-6, 1e-9}) {  // also in steps whose square drowns in the rounding of q
    stages.h = h;
    ASSERT_EQ(solver.solve(stages), ElementSolver::Result::converged);
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(stages.lambda_n(0, j), 3 * 9.81, 1e-12) << "h = " << h;
    EXPECT_EQ(stages.q1[0], 0.1);
  }
}

/// Two closed contacts on one coordinate: redundant where both are at rest, a contradiction where one comes down.
TEST(ClosedContact, ModesThatContradictEachOtherHaveNoSolution) {
  for (const double u : {0.0, 0.5}) {
    const auto p = read_scene_file(test_data("press.json"), {{"u", u}});
    Counters counters;
    ElementSystem elements(*p, make_tableau("radau-iia", 2), counters);
    ElementSolver solver(elements, 1e-14);
    Element stages;
    stages.resize(p->info(), 2);
    stages.q0 = p->info().q0;
    stages.v0 = p->info().v0;
    stages.h = 0.1;
    stages.modes = {ContactMode::closed, ContactMode::closed};
    EXPECT_EQ(solver.solve(stages) == ElementSolver::Result::converged, u == 0) << "u = " << u;
  }
}

}  // namespace
}  // namespace ricochet
