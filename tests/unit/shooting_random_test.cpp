// Shooting from random controls and random states of the plant: what cannot be run is a result, never an exception.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "methods/control/exploration.h"
#include "methods/control/shooting/shooting.h"
#include "methods/control/shrinking_horizon.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/scene_file/control_file.h"

namespace ricochet {
namespace {

/// Controls between their bounds, or up to 100 where there are none.
Matrix random_controls(const OptimalControlProblem& problem, std::mt19937& random) {
  Matrix u(problem.u.lower.size(), problem.n_intervals);
  for (Eigen::Index i = 0; i < u.rows(); ++i) {
    std::uniform_real_distribution<double> uniform(std::max(problem.u.lower[i], -100.0),
                                                   std::min(problem.u.upper[i], 100.0));
    for (double& value : u.row(i)) value = uniform(random);
  }
  return u;
}

void expect_consistent(const ControlSolution& solution) {
  if (!solution.has_plan()) {
    EXPECT_FALSE(solution.succeeded());
    EXPECT_NE(solution.message, "");
    return;
  }
  EXPECT_TRUE(std::isfinite(solution.trajectory.objective));
  EXPECT_TRUE(std::isfinite(solution.violation));
  EXPECT_TRUE(solution.trajectory.u.allFinite());
  for (const auto& point : solution.trajectory.points) EXPECT_TRUE(point.q.allFinite() && point.v.allFinite());
}

class RandomShooting : public testing::TestWithParam<const char*> {};

/// Control, then updates after the plant was moved by 1 mm to 1 m, and ten times its own velocity.
TEST_P(RandomShooting, EndsWithAPlanOrAReason) {
  const auto problem = make_control_problem(GetParam());
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    ShootingControlSolver solver(*problem, tableau, {.max_iterations = 2, .time_limit = 10},
                                 {.guesses = {random_controls(*problem, random)}});
    ShrinkingHorizon horizon(*problem, solver);
    const ControlSolution first = horizon.solve();
    expect_consistent(first);
    if (!first.has_plan()) continue;
    for (const double size : {1e-3, 0.1, 1.0, 10.0}) {
      if (horizon.advance() != Status::success) break;
      horizon.disturb(size, random);
      expect_consistent(horizon.resolve());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shooting, RandomShooting,
                         testing::Values("two_carts", "push_box_goal", "cart_pole_friction", "hopper", "discs",
                                         "three_boxes"),
                         [](const auto& test) { return std::string(test.param); });

/// Shooting of a free mass of 2 kg with up to 20 N for 2 s in 4 intervals, with `fields` of its control problem.
ControlSolution shoot_mass(const std::string& fields) {
  const auto problem = read_control_text(R"({"q0": ["0"], "v0": ["0"], "T": "2", "M": [["2"]], "f": ["0"],
      "Bu": [["1"]], "u": ["0"], "contacts": [{"gap": "q[0] + 100"}],
      "control": {"N": 4, "bounds": {"u": [["-20", "20"]]}, )" +
                                             fields + "}}",
                                         "f");
  return Shooting(*problem, tableau_argument(problem->tableau), {}).solve(problem->guess(4), 2);
}

TEST(Shooting, NamesTheIntervalOfACostThatIsNotFinite) {
  ASSERT_TRUE(shoot_mass(R"("running_cost": "u[0]**2")").succeeded());
  const ControlSolution running = shoot_mass(R"~("running_cost": "u[0]**2 + sqrt(1.2 - t)")~");
  EXPECT_EQ(running.status, Status::non_finite);
  EXPECT_EQ(running.message, "first guess: interval 3 of 4: the cost or a constraint is not finite");
  const ControlSolution terminal = shoot_mass(R"~("running_cost": "u[0]**2", "terminal_cost": "sqrt(-1 - q[0]**2)")~");
  EXPECT_EQ(terminal.status, Status::non_finite);
  EXPECT_EQ(terminal.message, "first guess: the terminal cost or a terminal constraint is not finite");
}

/// 20 N bring 2 kg by 20 m in 2 s.
TEST(Shooting, NamesTheConstraintThatCannotBeKept) {
  const ControlSolution solution =
      shoot_mass(R"("running_cost": "u[0]**2", "terminal": [{"name": "far", "value": "q[0] - 1000"}])");
  EXPECT_EQ(solution.status, Status::infeasible);
  EXPECT_NEAR(solution.violation, 980, 1e-6);
  EXPECT_NE(solution.message.find("the least violation found is 980: "), std::string::npos) << solution.message;
  EXPECT_NE(solution.violated.find("far"), std::string::npos) << solution.violated;
}

/// A rod that slides on its tip over ground so rough that no contact force is possible, or more than one motion: the scene
/// of Painleve's paradox, with a vertical control.
std::unique_ptr<OptimalControlProblem> rod_on_rough_ground(const std::string& u) {
  return read_control_text(R"~({"params": {"theta": "1.0471975511965976"},
      "q0": ["0", "sin(theta)", "theta"], "v0": ["-1", "0", "0"], "T": "0.4",
      "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1/3"]], "f": ["0", "-9.81", "0"],
      "Bu": [["0"], ["1"], ["0"]], "u": [")~" +
                               u + R"~("],
      "contacts": [{"name": "tip", "gap": "q[1]-sin(q[2])", "Jt": [["1", "0", "sin(q[2])"]], "mu": "2"}],
      "control": {"N": 4, "bounds": {"u": [["-20", "40"]]}, "running_cost": "u[0]**2"}})~",
                           "f");
}

TEST(Shooting, StatesIntervalAndReasonWhereTheFirstGuessHasNoMotion) {
  for (const auto& [u, reason] : {std::pair{"0", "the contact forces at contact 'tip' are inconsistent"},
                                  std::pair{"14", "the contact forces at contact 'tip' are indeterminate"}}) {
    const auto problem = rod_on_rough_ground(u);
    Shooting shooting(*problem, tableau_argument(problem->tableau), {});
    const ControlSolution solution = shooting.solve(problem->guess(4), 0.4);
    EXPECT_EQ(solution.status, Status::infeasible);
    EXPECT_FALSE(solution.has_plan());
    EXPECT_EQ(solution.message.find(std::string("first guess: interval 1 of 4: ") + reason), 0U) << solution.message;
  }
}

TEST(Shooting, ReportsThatNoneOfItsGuessesHasAMotion) {
  const auto problem = rod_on_rough_ground("0");
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  const ExplorationResult found = explore(*problem, tableau, problem->n_fe, {.rounds = 2, .samples = 10, .elite = 2});
  EXPECT_EQ(found.failed, found.rollouts);
  const std::vector<Matrix> guesses{Matrix::Constant(1, 4, -5), problem->guess(4), found.u};
  const ControlSolution solution = Shooting(*problem, tableau, {}).solve(guesses, 0.4);
  EXPECT_EQ(solution.status, Status::infeasible);
  EXPECT_FALSE(solution.has_plan());
  EXPECT_NE(solution.message.find("interval 1 of 4: the contact forces at contact 'tip'"), std::string::npos)
      << solution.message;
}

// A block on ground that gets smoother, without friction at q = 1.5 and without a meaning beyond: half of the controls that
// the cost asks for have no motion. They are steps that are not accepted.
TEST(Shooting, AStepWithoutAMotionIsNotAccepted) {
  const auto problem = read_control_text(R"~({"q0": ["0", "0"], "v0": ["0", "0"], "T": "1",
      "M": [["1", "0"], ["0", "1"]], "f": ["0", "-10"], "Bu": [["1"], ["0"]], "u": ["7"],
      "contacts": [{"name": "ground", "gap": "q[1]", "Jt": [["1", "0"]], "mu": "0.6-0.4*q[0]"}],
      "control": {"N": 4, "bounds": {"u": [["-20", "40"]]}, "running_cost": "0.001*u[0]**2",
                  "terminal_cost": "(q[0]-3)**2"}})~",
                                         "f");
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  const ProblemInfo& info = problem->plant->info();
  PlantRunner runner(*problem, tableau);
  PlantMotion motion;
  runner.run(info.q0, info.v0, Matrix::Constant(1, 4, 12), 0.25, motion);
  EXPECT_FALSE(motion.succeeded());
  runner.run(info.q0, info.v0, problem->guess(4), 0.25, motion);
  ASSERT_TRUE(motion.succeeded()) << motion.message;
  const ControlSolution solution = Shooting(*problem, tableau, {.max_iterations = 60}).solve(problem->guess(4), 1);
  ASSERT_TRUE(solution.has_plan()) << solution.message;
  EXPECT_LT(solution.trajectory.objective, 0.5 * motion.cost);
  EXPECT_GT(solution.rollouts, solution.iterations + 1) << "some were tried in vain";
  EXPECT_LT(solution.trajectory.points.back().q[0], 1.5);
}

}  // namespace
}  // namespace ricochet
