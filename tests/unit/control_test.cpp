// The transcription of optimal control problems: derivatives, the same discrete motion as the pivoting solver, and a
// problem whose solution the plant follows.
#include <gtest/gtest.h>

#include <random>

#include "bench/replay.h"
#include "methods/complementarity/homotopy.h"
#include "methods/control/fesd_transcription.h"
#include "methods/fesd/pivoting_solver.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/nlp_check.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using E = FesdEquations;

void expect_exact_derivatives(const std::string& id, const E::Options& options, const std::string& family, int n_s) {
  const auto problem = make_control_problem(id);
  problem->n_intervals = 1;
  FesdTranscription transcription(*problem, make_tableau(family, n_s), options);
  const Nlp& nlp = transcription.mpcc().nlp;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  const Vector x = Vector::NullaryExpr(nlp.n_variables(), [&] { return uniform(random); });
  const Vector lambda = Vector::NullaryExpr(nlp.n_rows(), [&] { return uniform(random); });
  expect_derivatives(nlp, x, lambda, 1e-5);  // differences of an objective of 1e4, of products of up to seven factors
}

TEST(FesdTranscription, HasExactDerivatives) {
  expect_exact_derivatives("discs", {}, "radau-iia", 2);
  expect_exact_derivatives("discs", {.impulses = E::Impulses::slack, .equilibration = E::Equilibration::exact}, "gauss",
                           2);
  expect_exact_derivatives("three_boxes", {}, "radau-iia", 2);
  expect_exact_derivatives("three_boxes", {.cone = E::Cone::squared, .equilibration = E::Equilibration::tanh},
                           "radau-iia", 1);
  expect_exact_derivatives("three_boxes", {.cone = E::Cone::polyhedral, .equilibration = E::Equilibration::exact},
                           "radau-iia", 1);
}

/// A step of the pivoting solver as the guess of the same step as an MPCC: how far it is from a solution, and the
/// solution that the homotopy finds from it.
void expect_same_step(const std::string& id, double before, double H, E::Options options) {
  const auto plant = id[0] == 'P' ? ground_truth_problem(id) : make_problem(id);
  const auto tableau = make_tableau("radau-iia", 3);
  Counters counters;
  PivotingSolver pivoting(*plant, tableau, {.n_fe = 2}, counters);
  pivoting.start(plant->info().q0, plant->info().v0);
  const int steps = static_cast<int>(std::lround(before / H));
  for (int k = 0; k < steps; ++k) ASSERT_EQ(pivoting.advance(H), Status::success) << id;
  const Vector q = steps > 0 ? pivoting.step().last().q1 : plant->info().q0;
  const Vector v = steps > 0 ? pivoting.step().last().v1 : plant->info().v0;
  ASSERT_EQ(pivoting.advance(H), Status::success) << id;

  Mpcc mpcc;
  options.shortest = 1e-3;
  E equations(*plant, tableau, options, mpcc);
  equations.add_interval(equations.add_initial_state(q, v), {}, H, -1, 1);
  equations.set_guess(pivoting.step(), 0);
  Vector x(mpcc.nlp.n_variables());
  for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = mpcc.nlp.variables[k].guess;
  NlpEvaluator evaluator(mpcc.nlp);
  const auto violation = evaluator.worst_violation(x.data());
  // Rounding of the springs' forces, 1e4 N.
  EXPECT_LE(violation.value, 1e-11) << id << ": " << violation.name;
  EXPECT_LE(complementarity(mpcc, x.data()).value, 1e-12) << id << ": " << complementarity(mpcc, x.data()).name;

  const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-8}).solve(mpcc);
  ASSERT_TRUE(s.succeeded()) << id << ": " << s.message;
  const FesdStep step = equations.read(s.x, 0);
  EXPECT_LE((step.last().q1 - pivoting.step().last().q1).cwiseAbs().maxCoeff(), 1e-8) << id;
  EXPECT_LE((step.last().v1 - pivoting.step().last().v1).cwiseAbs().maxCoeff(), 1e-8) << id;
}

TEST(FesdEquations, AreThoseThatThePivotingSolverSolves) {
  for (const auto impulses : {E::Impulses::position_velocity, E::Impulses::slack}) {
    expect_same_step("two_balls_spring", 0.40, 0.01, {.impulses = impulses});  // the first impact, at 0.40386 s
    expect_same_step("P3_sliding_block", 0.0, 0.1, {.impulses = impulses});
  }
  for (const auto cone : {E::Cone::exact, E::Cone::polyhedral})
    expect_same_step("P5_slip_reversal", 0.0, 0.1, {.cone = cone});
}

TEST(ControlProblems, AreChecked) {
  EXPECT_THROW(make_control_problem("disc"), InputError);
  EXPECT_THROW(make_control_problem("discs", {{"mass", 1}}), InputError);
  EXPECT_THROW(make_control_problem("discs", {{"r_ob", 1.9}}), InputError) << "the discs start inside of the obstacle";
  auto problem = make_control_problem("discs");
  problem->u.lower[0] = 31;
  EXPECT_THROW(validate(*problem), InputError) << "lower > upper";
  problem = make_control_problem("discs");
  problem->q.upper[0] = -3;
  EXPECT_THROW(validate(*problem), InputError) << "the initial state is outside";
  problem = make_control_problem("discs");
  problem->v.lower.resize(3);
  EXPECT_THROW(validate(*problem), InputError) << "sizes";
  EXPECT_EQ(control_problems().size(), 4u);
}

TEST(OptimalControl, PlantFollowsTheSolution) {
  const auto problem = make_control_problem("two_carts");
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 3),
                                  {.cross = E::CrossComplementarity::aggregated});
  ASSERT_EQ(transcription.set_guess(problem->plant->info().u.replicate(1, problem->n_intervals)), Status::success);
  const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-6}).solve(transcription.mpcc());
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LE(s.complementarity, 1e-12);
  EXPECT_LE(s.violation.value, 1e-9);
  EXPECT_LE(s.derivative_seconds, 0.2 * s.seconds);
  const ControlTrajectory trajectory = transcription.trajectory(s.x);
  EXPECT_LE(trajectory.objective, 100) << "1020 is the cost of doing nothing";
  EXPECT_NEAR(trajectory.objective, s.objective, 1e-2 * s.objective) << "but for the equilibration of the steps";
  for (const auto& solve : {reference_solver(1e-11), pivoting_solver(1e-9)}) {
    const Replay truth = replay(*problem, trajectory, solve);
    ASSERT_EQ(truth.status, Status::success) << truth.message;
    const ReplayMismatch difference = mismatch(*problem, trajectory, truth);
    // The goal of the project for its optimal control solutions.
    EXPECT_LE(difference.terminal, 1e-5);
    EXPECT_LE(difference.events, 1e-5);
    EXPECT_LE(std::abs(difference.cost), 1e-5 * truth.cost);
  }
}

}  // namespace
}  // namespace ricochet
