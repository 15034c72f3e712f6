// Optimal control of a plant whose force jumps: the optimum in closed form, its replay, derivatives, and what is declined.
#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "bench/control/control_options.h"
#include "bench/control/replay.h"
#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/fesd_transcription.h"
#include "methods/control/shrinking_horizon.h"
#include "methods/mpcc_equations/time_stepping_equations.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "tests/nlp_check.h"

namespace ricochet {
namespace {

// Full throttle for 3 s, 6 s at the speed limit, full brake for 3 s; the turbo begins at 2 s and ends at 10 s, inside of
// intervals of 1.5 s.
TEST(ControlRegions, TheTurboCarReachesItsGoalInMinimalTime) {
  const auto options = ControlOptions::parse("turbo_car --rho 0.01");
  const auto problem = options.make_problem();
  const auto transcription = options.make_transcription(*problem);
  const MpccSolution s = Homotopy(options.homotopy_options()).solve(transcription->mpcc());
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_EQ(s.complementarity, 0);
  const ControlTrajectory trajectory = transcription->trajectory(s.x);
  EXPECT_NEAR(trajectory.T, 12, 1e-8);  // bounds are met to the tolerance of Ipopt, 1e-10 of 25 m/s
  const double optimum[] = {5, 5, 0, 0, 0, 0, -5, -5};
  for (int k = 0; k < 8; ++k) EXPECT_NEAR(trajectory.u(0, k), optimum[k], 1e-7) << k;
  double switches[] = {kInfinity, kInfinity};  // distances of the nearest element boundaries
  for (const auto& point : trajectory.points) {
    switches[0] = std::min(switches[0], std::abs(point.t - 2));
    switches[1] = std::min(switches[1], std::abs(point.t - 10));
  }
  EXPECT_LE(std::max(switches[0], switches[1]), 1e-8);
  for (const auto& solve : {reference_solver(1e-11), pivoting_solver(1e-10)}) {
    const Replay truth = replay(*problem, trajectory, solve);
    ASSERT_EQ(truth.status, Status::success) << truth.message;
    const ReplayMismatch difference = mismatch(*problem, trajectory, truth);
    EXPECT_LE(difference.terminal, 1e-7);  // the acceleration is constant in every element: no error of the method
    EXPECT_LE(std::abs(difference.cost), 1e-8);
  }
}

TEST(ControlRegions, DerivativesAreExact) {
  for (const char* arguments :
       {"turbo_car -N 1 --equilibration exact", "turbo_car -N 1 --equilibration tanh --tableau gauss:2",
        "turbo_car -N 2 --discretisation time_stepping --steps 2"}) {
    const auto options = ControlOptions::parse(arguments);
    const auto problem = options.make_problem();
    const auto transcription = options.make_transcription(*problem);
    const Nlp& nlp = transcription->mpcc().nlp;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.5, 1.5);
    const Vector x = Vector::NullaryExpr(nlp.n_variables(), [&] { return uniform(random); });
    const Vector lambda = Vector::NullaryExpr(nlp.n_rows(), [&] { return uniform(random); });
    expect_derivatives(nlp, x, lambda, 1e-5);  // differences of products of up to seven factors
  }
}

// v = v_0 + h f(v) on the side of v, or v = 1 where neither side has a solution: f jumps from 3 to 1 there.
TEST(ControlRegions, StepsOfTimeSteppingAreImplicit) {
  const auto plant = read_scene_text(
      R"json({"q0": ["0"], "v0": ["0"], "T": 1, "M": [["1"]], "f": ["if(v[0]**2 < 1, 3, 1)"], "contacts": []})json",
      "scene");
  for (const auto& [v_0, v] : {std::pair(0.2, 0.95), {0.5, 1.0}, {1.2, 1.45}}) {
    const double h = 0.25;
    Mpcc mpcc;
    TimeSteppingEquations equations(*plant, {}, mpcc);
    equations.add_step(equations.add_initial_state(Vector::Zero(1), Vector::Constant(1, v_0)), {},
                       mpcc.nlp.add_variable(h, h, h, "h"));
    const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-8}).solve(mpcc);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(equations.velocity(s.x, 0)[0], v, 1e-8) << v_0;
  }
}

// A friction element of 3 N brakes 1 kg, and holds it.
TEST(ControlRegions, StepsOfTimeSteppingHaveFrictionElements) {
  const auto plant = read_scene_text(
      R"json({"q0": ["0"], "v0": ["0"], "T": 1, "M": [["1"]], "f": ["1"], "contacts": [],
              "friction": [{"name": "guide", "Jt": [["1"]], "bound": "3"}]})json",
      "scene");
  for (const auto cone : {FrictionCone::exact, FrictionCone::polyhedral}) {
    for (const auto& [v_0, v] : {std::pair(1.0, 0.8), {0.1, 0.0}, {-1.0, -0.6}}) {
      const double h = 0.1;
      Mpcc mpcc;
      TimeSteppingEquations equations(*plant, {.cone = cone}, mpcc);
      Vector q(2), velocity(2);
      q << 0, 0;
      velocity << v_0, 0;
      equations.add_step(equations.add_initial_state(q, velocity), {}, mpcc.nlp.add_variable(h, h, h, "h"));
      const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-8}).solve(mpcc);
      ASSERT_TRUE(s.succeeded()) << s.message;
      EXPECT_NEAR(equations.velocity(s.x, 0)[0], v, 1e-8) << v_0;
      EXPECT_NEAR(equations.normal_impulse(s.x, 0)[0], 0.3, 1e-8) << v_0;
    }
  }
}

TEST(ControlRegions, OthersDecline) {
  const auto problem = make_control_problem("turbo_car");
  EXPECT_THROW(ControlOptions::parse("turbo_car --discretisation time_freezing").make_transcription(*problem),
               InputError);
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 2), {});
  HomotopyControlSolver solver(transcription, {});
  EXPECT_THROW(ShrinkingHorizon(*problem, solver), InputError);
}

}  // namespace
}  // namespace ricochet
