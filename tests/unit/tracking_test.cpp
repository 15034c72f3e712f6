// Controls with which the plant follows given states, and shooting from a relaxation.
#include "methods/control/shooting/tracking.h"

#include <gtest/gtest.h>

#include "bench/control/control_guess.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// Largest difference of the positions of a motion from given states.
double largest_miss(const PlantMotion& motion, const Matrix& y) {
  const Eigen::Index n_q = y.rows() / 2;
  return (motion.x - y).topRows(n_q).cwiseAbs().maxCoeff();
}

// The first disc pushes the second one on: states of such a motion, and controls that miss them.
TEST(Tracking, FindsTheControlsOfAMotionThatThePlantCanDo) {
  for (const char* name : {"two_carts", "discs"}) {
    const auto problem = make_control_problem(name);
    const ProblemInfo& info = problem->plant->info();
    PlantRunner runner(*problem, tableau_argument(problem->tableau));
    const int N = problem->n_intervals;
    const double H = info.end_time / N;
    Matrix u = Matrix::Zero(info.n_u, N);
    for (int k = 0; k < N; ++k) u.col(k) = Vector::Constant(info.n_u, k % 5 - 1.0).cwiseMax(-4).cwiseMin(4);
    u.row(0).array() += 3;
    PlantMotion motion;
    runner.run(info.q0, info.v0, u, H, motion);
    ASSERT_TRUE(motion.succeeded()) << motion.message;
    const Matrix y = motion.x;
    const Matrix w = 0.8 * u;
    runner.run(info.q0, info.v0, w, H, motion);
    const double before = largest_miss(motion, y);

    const Tracking tracked = track(runner, w, H, y, {.by_control = 1e-4});
    EXPECT_EQ(tracked.message, "") << name;
    runner.run(info.q0, info.v0, tracked.u, H, motion);
    ASSERT_TRUE(motion.succeeded()) << motion.message;
    EXPECT_GT(before, 0.05) << name;
    EXPECT_LE(largest_miss(motion, y), 1e-2 * before) << name << ": all but the weight of the controls";
    EXPECT_LE(largest_miss(motion, y), tracked.distance + 1e-9) << name;
    EXPECT_TRUE((track(runner, u, H, y, {}).u - u).isZero(1e-6)) << name << ": the controls were right";
  }
}

TEST(Tracking, KeepsTheBoundsOfTheControls) {
  const auto problem = make_control_problem("two_carts");
  const ProblemInfo& info = problem->plant->info();
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  const int N = problem->n_intervals;
  Matrix y = Matrix::Constant(2 * info.n_q, N + 1, 100);  // far away
  y.col(0) << info.q0, info.v0;
  const Tracking tracked = track(runner, Matrix::Zero(info.n_u, N), info.end_time / N, y, {});
  EXPECT_TRUE((tracked.u.array() <= problem->u.upper.replicate(1, N).array()).all());
  EXPECT_TRUE((tracked.u.array() >= problem->u.lower.replicate(1, N).array()).all());
}

TEST(Tracking, RejectsSizesThatDoNotAgree) {
  const auto problem = make_control_problem("two_carts");
  const ProblemInfo& info = problem->plant->info();
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  const Matrix u = Matrix::Zero(info.n_u, 3), y = Matrix::Zero(2 * info.n_q, 4);
  EXPECT_THROW(track(runner, Matrix::Zero(info.n_u + 1, 3), 0.1, y, {}), InputError);
  EXPECT_THROW(track(runner, u, 0.1, y.leftCols(3), {}), InputError);
  EXPECT_THROW(track(runner, u, 0.1, y, {.window = 0}), InputError);
  EXPECT_THROW(track(runner, u, 0.1, y, {.iterations = 0}), InputError);
  EXPECT_THROW(track(runner, u, 0.1, y, {.by_control = 0}), InputError);
}

// Ipopt looks at its clock after every iteration, so that few of the hundreds needed are made.
TEST(Tracking, FollowsTheLastPointOfARelaxationThatEndsAtALimit) {
  const ControlOptions options =
      ControlOptions::parse("discs --method shooting --from-relaxation 0.01 --noise 0.5 --time-limit 0.1");
  const auto problem = options.make_problem();
  const GuessedControls guess = guessed_controls(options);
  ASSERT_EQ(guess.u.size(), 1U);
  EXPECT_EQ(guess.u[0].cols(), problem->n_intervals);
  EXPECT_TRUE(guess.u[0].allFinite());
  EXPECT_EQ(guess.T, problem->plant->info().end_time);
  ASSERT_EQ(guess.notes.size(), 2U);
  EXPECT_NE(guess.notes[0].find("relaxation with sigma = 1"), std::string::npos) << guess.notes[0];
}

std::string refused_relaxation(const std::string& arguments) {
  try {
    ControlOptions::parse(arguments).make_problem();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Tracking, RejectsRelaxationsOutOfRange) {
  const std::string shooting = "discs --method shooting --from-relaxation ";
  EXPECT_EQ(refused_relaxation(shooting + "0.01 --sigma-0 0.1 --noise 0.5 --linear-solver ldl"), "");
  for (const char* wrong : {"0", "-1", "nan", "2", "0.01 --sigma-0 0.001"})
    EXPECT_NE(refused_relaxation(shooting + wrong).find("a number > 0 and <= --sigma-0"), std::string::npos) << wrong;
  EXPECT_NE(refused_relaxation(shooting + "0.01 --explore 2 --starts 2").find("--starts"), std::string::npos);
  EXPECT_NE(refused_relaxation(shooting + "0.01 --sigma-final 1e-3").find("--sigma-final"), std::string::npos);
  EXPECT_NE(refused_relaxation("discs --method shooting --noise 0.5").find("--noise"), std::string::npos);
  EXPECT_NE(refused_relaxation("discs --from-relaxation 0.01").find("--from-relaxation"), std::string::npos);
}

}  // namespace
}  // namespace ricochet
