// Shooting again from where the plant is, and from coarse to fine.
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "methods/control/exploration.h"
#include "methods/control/shooting/refinement.h"
#include "methods/control/shrinking_horizon.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

ShootingControlSolver::Start explored_start(const OptimalControlProblem& problem) {
  return {explore(problem, tableau_argument(problem.tableau), problem.n_fe, {.rounds = 12}).starts};
}

/// Solves, and after every interval moves the plant and solves the rest.
void follow_by_shooting(const OptimalControlProblem& problem, ShootingControlSolver::Start start, double disturbance,
                        const std::function<void(const ShrinkingHorizon&, const ControlSolution&)>& check) {
  ShootingControlSolver solver(problem, tableau_argument(problem.tableau), {}, std::move(start));
  ShrinkingHorizon horizon(problem, solver);
  const ControlSolution first = horizon.solve();
  ASSERT_TRUE(first.succeeded()) << first.message;
  std::mt19937 random(1);
  for (int k = 1; k < problem.n_intervals; ++k) {
    const Matrix given = horizon.plan().u.leftCols(k);
    ASSERT_EQ(horizon.advance(), Status::success);
    if (disturbance > 0) horizon.disturb(disturbance, random);
    check(horizon, horizon.resolve());
    EXPECT_EQ(horizon.plan().u.leftCols(k), given) << "what the plant was given is past";
  }
  EXPECT_EQ(horizon.advance(), Status::success);
}

TEST(ShootingHorizon, TheRestOfAnOptimalPlanIsOptimal) {
  const auto problem = make_control_problem("two_carts");
  double whole = 0;
  follow_by_shooting(*problem, explored_start(*problem), 0,
                     [&](const ShrinkingHorizon& horizon, const ControlSolution& again) {
                       ASSERT_TRUE(again.succeeded()) << again.message;
                       EXPECT_TRUE(again.is_b_stationary) << again.stationarity;
                       EXPECT_LE(again.iterations, 5) << "4 in the first, 1 in all others; the first solve takes 44";
                       const double total = horizon.cost_so_far() + horizon.cost_to_go();
                       // A solution is stationary to rounding, so costs agree to its square and to sums of 20 terms.
                       EXPECT_NEAR(total, whole > 0 ? whole : total, 1e-9 * total) << horizon.interval();
                       whole = total;
                     });
}

TEST(ShootingHorizon, StartsWhereThePlantIs) {
  const auto problem = make_control_problem("two_carts");
  follow_by_shooting(*problem, explored_start(*problem), 0.03,
                     [&](const ShrinkingHorizon& horizon, const ControlSolution& again) {
                       ASSERT_TRUE(again.has_plan()) << again.message;
                       ASSERT_FALSE(horizon.plan().points.empty());
                       const auto& start = horizon.plan().points.front();
                       EXPECT_EQ(start.q, horizon.q());
                       EXPECT_EQ(start.v, horizon.v());
                       EXPECT_NEAR(start.t, horizon.interval() * horizon.plan().T / problem->n_intervals, 1e-12);
                       EXPECT_LE(again.violation, 1e-9);
                     });
}

TEST(ShootingHorizon, EndsAtALimitWithAPlan) {
  const auto problem = make_control_problem("two_carts");
  ShootingControlSolver::Start start = explored_start(*problem);
  start.warm_time_limit = 1e-9;
  follow_by_shooting(*problem, std::move(start), 0.01,
                     [&](const ShrinkingHorizon& horizon, const ControlSolution& again) {
                       EXPECT_EQ(again.status, Status::time_limit);
                       EXPECT_NE(again.message.find("time limit of 1e-09 s"), std::string::npos) << again.message;
                       EXPECT_TRUE(again.has_plan());
                       EXPECT_EQ(horizon.plan().points.front().q, horizon.q()) << "from where it is";
                     });
}

// With a free T an update may change the length of the remaining intervals: T = N H stays within its bounds, and the
// rest never costs more than that of the plan before, which is where it starts.
TEST(ShootingHorizon, KeepsTheBoundsOfAFreeEndTime) {
  const auto problem = make_control_problem("two_carts");
  problem->is_time_free = true;
  problem->T_lower = 1.5;
  problem->T_upper = 2.5;
  double before = kInfinity;
  follow_by_shooting(*problem, explored_start(*problem), 0,
                     [&](const ShrinkingHorizon& horizon, const ControlSolution& again) {
                       ASSERT_TRUE(again.has_plan()) << again.message;
                       EXPECT_GE(horizon.plan().T, 1.5 - 1e-9);
                       EXPECT_LE(horizon.plan().T, 2.5 + 1e-9);
                       const double total = horizon.cost_so_far() + horizon.cost_to_go();
                       EXPECT_LE(total, before * (1 + 1e-9)) << horizon.interval();
                       before = total;
                     });
}

TEST(ShootingHorizon, APlantThatCannotGoOnHasNoPlan) {
  const auto problem = make_control_problem("two_carts");
  Shooting shooting(*problem, tableau_argument(problem->tableau), {});
  ASSERT_TRUE(shooting.solve(explored_start(*problem).guesses, 2).succeeded());
  const Vector q = problem->plant->info().q0, nowhere = Vector::Constant(q.size(), NAN);
  const ControlSolution lost = shooting.resolve(1, nowhere, q, {});
  EXPECT_FALSE(lost.has_plan());
  EXPECT_NE(lost.status, Status::success);
  EXPECT_TRUE(shooting.resolve(1, q, problem->plant->info().v0).has_plan()) << "the last motion is there";
  EXPECT_THROW(shooting.set_time_limit(-1), InputError);
}

TEST(ShootingRefinement, SplitsIntervals) {
  EXPECT_EQ(split_intervals(Matrix{{1, 2}, {3, 4}}), (Matrix{{1, 1, 2, 2}, {3, 3, 4, 4}}));
}

TEST(ShootingRefinement, GoesOnFromTheCoarseSolution) {
  const auto problem = make_control_problem("two_carts");  // 10 intervals
  const auto start = explored_start(*problem);
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  Shooting shooting(*problem, tableau, {});
  const ControlSolution coarse = shooting.solve(start.guesses, 2);
  int last = 0;
  const ControlSolution fine = solve_refined(shooting, start.guesses, 2, 2, [&](const ShootingIteration& at) {
    EXPECT_EQ(at.number, last + 1);
    last = at.number;
  });
  ASSERT_TRUE(coarse.succeeded() && fine.succeeded()) << fine.message;
  EXPECT_EQ(fine.trajectory.u.cols(), 40);
  EXPECT_GT(fine.iterations, coarse.iterations);
  EXPECT_LT(fine.trajectory.objective, coarse.trajectory.objective) << "it has more controls";

  ShootingOptions options;
  options.time_limit = 1e-9;
  Shooting late(*problem, tableau, options);
  const ControlSolution stopped = solve_refined(late, start.guesses, 1, 2);
  EXPECT_EQ(stopped.status, Status::time_limit);
  EXPECT_EQ(stopped.trajectory.u.cols(), 20) << "a plan of all intervals, without time";
  EXPECT_EQ(late.time_limit(), 1e-9);
}

}  // namespace
}  // namespace ricochet
