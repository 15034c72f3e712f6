// Optimal control by time freezing: derivatives, a motion that fulfils the equations, and a solution that the plant follows.
#include <gtest/gtest.h>

#include <random>

#include "bench/control/control_options.h"
#include "bench/control/replay.h"
#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/time_freezing_transcription.h"
#include "problems/input_error.h"
#include "tests/nlp_check.h"

namespace ricochet {
namespace {

TEST(TimeFreezingTranscription, HasExactDerivatives) {
  for (const char* id : {"two_carts", "hopper"}) {
    const auto problem = make_control_problem(id);
    problem->n_intervals = 1;
    problem->is_time_free = true;
    problem->T_lower = 1;
    problem->T_upper = 10;
    const TimeFreezingTranscription transcription(*problem, make_tableau("radau-iia", 2), {});
    const Nlp& nlp = transcription.mpcc().nlp;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.5, 1.5);
    const Vector x = Vector::NullaryExpr(nlp.n_variables(), [&] { return uniform(random); });
    const Vector lambda = Vector::NullaryExpr(nlp.n_rows(), [&] { return uniform(random); });
    expect_derivatives(nlp, x, lambda, 1e-5);  // differences of an objective of 1e4, of products of up to seven factors
  }
}

/// Rows and pairs at the guess of a program.
void expect_fulfilled(const Mpcc& mpcc) {
  const Nlp& nlp = mpcc.nlp;
  Vector x(nlp.n_variables()), rows(nlp.n_rows());
  for (int k = 0; k < nlp.n_variables(); ++k) x[k] = nlp.variables[k].guess;
  NlpEvaluator evaluator(nlp);
  evaluator.constraints(x.data(), rows.data());
  for (int i = 0; i < nlp.n_rows(); ++i) {
    if (nlp.rows[i].name.find("leg") != std::string::npos) continue;   // its length, a path constraint
    EXPECT_LE(rows[i], nlp.rows[i].upper + 1e-9) << nlp.rows[i].name;  // rounding of 15 m/s or 12 N over 8e-3 s
    EXPECT_GE(rows[i], nlp.rows[i].lower - 1e-9) << nlp.rows[i].name;
  }
  for (const auto& pair : mpcc.pairs) {
    double G = 0, H = 0;
    for (const int k : pair.G) G += x[k];
    for (const int k : pair.H) H += x[k];
    EXPECT_NEAR(std::min(G, H), 0, 1e-9) << pair.name;
  }
}

/// Held by its leg: time runs slower than pseudo time, and everything else rests.
TEST(TimeFreezingTranscription, AStandingPlantFulfilsTheEquations) {
  const auto problem = make_control_problem("hopper");
  problem->n_intervals = 2;
  TimeFreezingTranscription transcription(*problem, make_tableau("radau-iia", 3), {});
  ASSERT_EQ(transcription.guess_from_simulation(), Status::success);
  for (auto& variable : transcription.mpcc().nlp.variables)  // the initial state is no stage of the simulation
    if (variable.name.starts_with("start, ")) variable.guess = 0;
  expect_fulfilled(transcription.mpcc());
}

/// The body falls, and the foot slides, braked by mu m_f g: accelerations are constant, and stages of order 5 exact.
TEST(TimeFreezingTranscription, ASlidingPlantFulfilsTheEquations) {
  const double g = 9.81, mu = 1, m_f = 0.2, H = 0.1;
  const auto plant = std::move(make_control_problem("hopper")->plant);
  const ButcherTableau tableau = make_tableau("radau-iia", 3);
  for (const double slip : {-15.0, 15.0}) {
    const double sign = slip > 0 ? 1 : -1;
    const Vector q0 = plant->info().q0, v0{{0, 0, slip, 0}}, w{{0, -g, -sign * mu * g, 0}};
    Mpcc mpcc;
    TimeFreezingEquations equations(
        *plant, tableau, {.n_fe = 2, .push = Vector::Constant(1, 20), .k = 0, .damping = Vector::Zero(1)}, mpcc);
    const std::vector<int> u{mpcc.nlp.add_variable(0, 0, 0, "u_1"), mpcc.nlp.add_variable(0, 0, 0, "u_2")};
    const auto start = equations.add_start(equations.add_initial_state(q0, v0));
    equations.add_interval(start, u, H, -1, 1);
    for (const auto* parts : {&start.gap, &start.rate, &start.slip}) {
      mpcc.nlp.variables[parts->plus[0]].guess = parts == &start.slip ? std::max(slip, 0.0) : 0;
      mpcc.nlp.variables[parts->minus[0]].guess = parts == &start.slip ? std::max(-slip, 0.0) : 0;
    }
    double t = 0;
    for (const auto& element : equations.intervals()[0]) {
      for (int j = 0; j < tableau.n_s; ++j) {
        const double at = t + tableau.c[j] * H / 2;
        equations.set_guess(element.stages[j], q0 + at * v0 + at * at / 2 * w, v0 + at * w, w,
                            Vector::Constant(1, m_f * g), Vector::Constant(1, -sign * mu * m_f * g));
      }
      equations.set_length_guess(element, H / 2);
      t += H / 2;
    }
    expect_fulfilled(mpcc);
  }
}

TEST(TimeFreezingTranscription, ThePlantFollowsTwoCarts) {
  const auto options =
      ControlOptions::parse("two_carts --discretisation time_freezing --sigma-0 0.1 --factor 0.1 --max-branches 0");
  const auto problem = options.make_problem();
  const auto transcription = options.make_transcription(*problem);
  const MpccSolution solution = Homotopy(options.homotopy_options()).solve(transcription->mpcc());
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  const ControlTrajectory trajectory = transcription->trajectory(solution.x);
  const Replay run = replay(*problem, trajectory, pivoting_solver(1e-9));
  ASSERT_EQ(run.status, Status::success) << run.message;
  // One element of order 5 for half an oscillation of the bounce: 4e-3 was seen. Its time is the end of an interval.
  const ReplayMismatch missed = mismatch(*problem, trajectory, run);
  EXPECT_LE(missed.terminal, 0.02);
  EXPECT_LE(missed.events, 1e-6) << "the same impacts";
  EXPECT_FALSE(run.events.empty());
}

TEST(TimeFreezingTranscription, SaysWhatItCannotRun) {
  const auto carts = make_control_problem("two_carts");
  EXPECT_THROW(TimeFreezingTranscription(*carts, make_tableau("gauss", 2), {}), InputError);
  const auto boxes = make_control_problem("three_boxes");  // friction and restitution
  EXPECT_THROW(TimeFreezingTranscription(*boxes, make_tableau("radau-iia", 2), {}), InputError);
}

}  // namespace
}  // namespace ricochet
