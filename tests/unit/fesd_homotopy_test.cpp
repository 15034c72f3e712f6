// FESD-J by homotopy: the motion of the pivoting solver, from its steps and from far away; what cannot be solved.
#include <gtest/gtest.h>

#include <algorithm>

#include "bench/studies/homotopy/homotopy.h"
#include "methods/fesd_homotopy/options.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

StepHomotopy::Options options(const std::string& text) {
  return step_homotopy_options(MethodSpec("fesd_homotopy:radau-iia:2," + text));
}

Settings twenty_steps() {
  Settings settings;
  settings.steps = 20;
  return settings;
}

void expect_pivoting_motion(const std::string& family, int n_s, int N, const std::string& text) {
  const auto problem = make_problem("two_balls_spring");
  const PivotingRun pivoting = run_pivoting(*problem, make_tableau(family, n_s), N);
  ASSERT_EQ(pivoting.status, Status::success) << pivoting.message;
  const HomotopyRun run = run_homotopy(*problem, pivoting, options(text), 1);
  EXPECT_EQ(run.failed, 0) << run.failures[0];
  if (family == "radau-iia" && n_s == 1) return;  // its capture of a bounce is one solution of two
  ASSERT_FALSE(run.distances.empty());
  // 1e-11 is the tolerance of the rows; the spring of 1e4 N/m makes 100 times as much of it in three steps.
  EXPECT_LE(*std::ranges::max_element(run.distances), 1e-9) << family << " " << n_s << " N = " << N;
}

TEST(FesdHomotopy, StaysWithThePivotingSolver) {
  for (const char* family : {"radau-iia", "gauss"}) {
    for (int n_s = 1; n_s <= 4; ++n_s) {
      for (const int N : {60, 250}) expect_pivoting_motion(family, n_s, N, "guess=pivoting");
    }
  }
}

TEST(FesdHomotopy, FindsItFromAFlight) {
  for (const auto* family : {"radau-iia", "gauss"}) expect_pivoting_motion(family, 3, 100, "guess=ballistic");
}

TEST(FesdHomotopy, FindsItFromAConstantState) {
  expect_pivoting_motion("radau-iia", 2, 100, "guess=cold");
}

TEST(FesdHomotopy, SolvesTheAppendixFormToo) {
  expect_pivoting_motion("radau-iia", 2, 100, "impulses=slack,cross=aggregated");
}

TEST(FesdHomotopy, IsAMethod) {
  const auto problem = make_problem("two_balls_spring", {{"duration", 0.41}});
  const Solution s = make_method("fesd_homotopy:gauss:3")->solve(*problem, twenty_steps());
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_EQ(s.events[0].kind, EventKind::impact);
  EXPECT_NEAR(s.events[0].t, 0.4038550218769218, 1e-8);  // the error of the method at this step length
  EXPECT_EQ(s.counters.steps, 20);
  EXPECT_EQ(s.counters.elements, 40);
  EXPECT_GE(s.counters.complementarity_solves, 20);
  EXPECT_GE(s.counters.inner_iterations, s.counters.complementarity_solves);
}

// A control is an argument of the dynamics.
TEST(FesdHomotopy, FollowsADrivenMechanism) {
  const auto problem = make_problem("double_pendulum_wall", {{"duration", 0.3}});
  ASSERT_EQ(problem->info().n_u, 1);
  const Solution homotopy = make_method("fesd_homotopy:radau-iia:3")->solve(*problem, twenty_steps());
  const Solution pivoting = make_method("fesd:radau-iia:3")->solve(*problem, twenty_steps());
  ASSERT_TRUE(homotopy.succeeded()) << homotopy.message;
  ASSERT_TRUE(pivoting.succeeded()) << pivoting.message;
  // Twenty steps to 1e-11 each.
  EXPECT_LE((homotopy.q - pivoting.q).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LE((homotopy.v - pivoting.v).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(FesdHomotopy, NamesTheWorstResidualOfAStepWithoutSolution) {
  const auto problem = make_problem("two_balls_spring", {{"duration", 0.41}});
  const Solution s = make_method("fesd_homotopy:radau-iia:2,n_fe=1")->solve(*problem, twenty_steps());
  EXPECT_FALSE(s.succeeded());
  EXPECT_EQ(s.message.find("step 20 of 20, from t = 0.3895 s: "), 0u) << s.message;
  EXPECT_NE(s.message.find("the largest violation is "), std::string::npos) << s.message;
}

TEST(FesdHomotopy, ChecksItsOptions) {
  for (const char* text : {"guess=warm", "sigma_0=-1", "relaxation=x", "retry=-1", "factor=1", "cone=round",
                           "sigma_0=1e-3,sigma_n=1e-2", "cone=squared"})
    EXPECT_THROW(make_method("fesd_homotopy:radau-iia:2," + std::string(text)), InputError) << text;
  EXPECT_NO_THROW(make_method("fesd_homotopy:radau-iia:2,cone=squared,crossover=off"));
}

}  // namespace
}  // namespace ricochet
