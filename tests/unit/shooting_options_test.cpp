// Options of `ricochet control` that belong to one method; the replay of a solution by both integrators; what a solution
// is in the program of the homotopy.
#include <gtest/gtest.h>

#include <algorithm>

#include "bench/control/control_guess.h"
#include "bench/control/control_options.h"
#include "bench/control/replay.h"
#include "methods/complementarity/mpcc/crossover.h"
#include "methods/complementarity/mpcc/stationarity.h"
#include "methods/control/shooting/shooting.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

std::string refusal(const std::string& arguments) {
  try {
    ControlOptions::parse(arguments).make_problem();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void expect_refusal(const std::string& arguments, const std::string& part) {
  EXPECT_NE(refusal(arguments).find(part), std::string::npos) << arguments << ": " << refusal(arguments);
}

TEST(ShootingOptions, RejectsThoseOfTheOtherMethod) {
  EXPECT_EQ(refusal("two_carts --method shooting --explore 3 --knots 4 --starts 2 --elements 3 --time-limit 5"), "");
  EXPECT_EQ(refusal("two_carts --explore 3 --knots 4 --sigma-0 0.01"), "");
  expect_refusal("two_carts --method shooting --sigma-0 0.01", "--sigma-0");
  expect_refusal("two_carts --method shooting --simulate", "--simulate");
  expect_refusal("two_carts --method shooting --capture", "--capture");
  expect_refusal("two_carts --method shooting --discretisation time_stepping", "fesd is required");
  expect_refusal("two_carts --method shooting --discretisation time_freezing", "fesd is required");
  expect_refusal("two_carts --explore 3 --starts 2", "--starts");
  expect_refusal("two_carts --refine 1", "no value is allowed with --method homotopy");
  expect_refusal("two_carts --method newton", "--method");
}

TEST(ShootingOptions, RejectsValuesOutOfRange) {
  expect_refusal("two_carts --explore 3 --knots 1", "from 2 to the number of control intervals, 10");
  expect_refusal("two_carts --explore 3 --knots 11", "from 2 to the number of control intervals, 10");
  expect_refusal("two_carts --explore 3 --knots -2", "from 2 to the number of control intervals, 10");
  expect_refusal("two_carts --method shooting --explore 3 --starts 0", "starts");
  expect_refusal("two_carts --explore 3 --knots 0", "from 2 to the number of control intervals");
  expect_refusal("two_carts --method shooting --explore 3 --starts -1", "starts = -1: a number >= 1 is required");
  expect_refusal("two_carts --knots 4", "--explore is required");
  expect_refusal("two_carts --method shooting --refine -1", "--refine = -1: a number from 0 to 1 is required");
  expect_refusal("two_carts --method shooting --refine 2", "10 intervals can be halved so many times");
  expect_refusal("two_carts --method shooting --refine 1 --explore 3 --knots 6", "control intervals, 5, is required");
  EXPECT_THROW(ControlOptions::parse("two_carts --method shooting").homotopy_options(), InputError)
      << "a study of the homotopy";
}

TEST(ShootingOptions, EverySolutionIsReplayed) {
  const auto options = ControlOptions::parse("two_carts -N 20 --method shooting --explore 12 --starts 2");
  const auto problem = options.make_problem();
  Shooting shooting(*problem, tableau_argument(problem->tableau), options.shooting);
  const auto guess = guessed_controls(options);
  EXPECT_EQ(guess.u.size(), 2U);
  const ControlSolution solution = shooting.solve(guess.u, problem->plant->info().end_time);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  // The plan has the error of its own steps: 1.1e-9 and 1.8e-7 with 10 intervals of order 5, 1/32 of that with 20.
  for (const auto& solve : {pivoting_solver(1e-12), reference_solver(1e-11)}) {
    const Replay truth = replay(*problem, solution.trajectory, solve);
    ASSERT_EQ(truth.status, Status::success) << truth.message;
    const ReplayMismatch difference = mismatch(*problem, solution.trajectory, truth);
    EXPECT_LE(difference.terminal, 1e-9);
    EXPECT_LE(std::abs(difference.cost), 1e-7);
  }
}

// That of push_box_goal is not: the program may move the times of breaks (methods/control/README.md, "Which method").
TEST(ShootingOptions, ASolutionIsStationaryInTheProgramOfTheHomotopy) {
  for (const std::string problem_id : {"two_carts", "cart_pole_friction"}) {
    const auto options = ControlOptions::parse(problem_id + " --method shooting --explore 12 --starts 2");
    const auto problem = options.make_problem();
    Shooting shooting(*problem, tableau_argument(problem->tableau), options.shooting);
    const ControlSolution solution = shooting.solve(guessed_controls(options).u, problem->plant->info().end_time);
    ASSERT_TRUE(solution.succeeded()) << problem_id << ": " << solution.message;
    const auto is_S = [&](const Matrix& u) {
      const auto transcription =
          ControlOptions::parse(problem_id + " --equilibration none").make_transcription(*problem);
      EXPECT_EQ(transcription->guess_from_simulation(u), Status::success);
      const Nlp& nlp = transcription->mpcc().nlp;
      Vector x(nlp.n_variables());
      std::ranges::transform(nlp.variables, x.begin(), &Nlp::Variable::guess);
      EXPECT_LE(NlpEvaluator(nlp).worst_violation(x.data()).value, 1e-12) << problem_id;
      EXPECT_LE(complementarity(transcription->mpcc(), x.data()).value, 1e-12) << problem_id;
      // Around a switch the motion of shooting has other elements. Both are S to 1e-5, cart_pole_friction not to 3e-6.
      return StationarityTest(transcription->mpcc(), x, 1e-4).is_S({});
    };
    EXPECT_TRUE(is_S(solution.trajectory.u)) << problem_id;
    EXPECT_FALSE(is_S(0.99 * solution.trajectory.u)) << problem_id;
  }
}

}  // namespace
}  // namespace ricochet
