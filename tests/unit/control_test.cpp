// The transcription of optimal control problems: derivatives, the same discrete motion as the pivoting solver, and a
// problem whose solution the plant follows.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <random>
#include <stdexcept>
#include <utility>

#include "bench/control/control_options.h"
#include "bench/control/replay.h"
#include "bench/studies/control/gradient.h"
#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/exploration.h"
#include "methods/control/fesd_transcription.h"
#include "methods/control/shrinking_horizon.h"
#include "methods/control/time_stepping_transcription.h"
#include "methods/fesd/pivoting_solver.h"
#include "methods/mpcc_equations/nlp_blocks.h"
#include "methods/registry.h"
#include "problems/derivatives/plant_functions.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/nlp_check.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using E = FesdEquations;

using TS = TimeSteppingEquations;

void expect_exact_derivatives(const Transcription& transcription) {
  const Nlp& nlp = transcription.mpcc().nlp;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  const Vector x = Vector::NullaryExpr(nlp.n_variables(), [&] { return uniform(random); });
  const Vector lambda = Vector::NullaryExpr(nlp.n_rows(), [&] { return uniform(random); });
  expect_derivatives(nlp, x, lambda, 1e-5);  // differences of an objective of 1e4, of products of up to seven factors
}

void expect_exact_derivatives(const std::string& id, const E::Options& options, const std::string& family, int n_s) {
  const auto problem = make_control_problem(id);
  problem->n_intervals = 1;
  expect_exact_derivatives(FesdTranscription(*problem, make_tableau(family, n_s), options));
}

void expect_exact_derivatives(const std::string& id, const TimeSteppingTranscription::Options& options) {
  const auto problem = make_control_problem(id);
  problem->n_intervals = 2;
  problem->is_time_free = true;
  problem->T_lower = 1;
  problem->T_upper = 10;
  expect_exact_derivatives(TimeSteppingTranscription(*problem, options));
}

TEST(FunctionBlock, TakesOneVariablePerInput) {
  const PlantFunctions functions = plant_functions(*make_problem("double_pendulum_wall"), 0);
  EXPECT_NO_THROW(FunctionBlock(functions.gap, {0, 1}, {0, 1}));
  EXPECT_THROW(FunctionBlock(functions.gap, {0}, {0, 1}), std::logic_error);
}

// GiNaC orders terms by symbols, and symbols by the time they were made at.
TEST(PlantFunctions, RoundTheSameWheneverTheyAreMade) {
  const auto problem = make_problem("double_pendulum_wall");
  const PlantFunctions first = plant_functions(*problem, 0);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(0.1, 1);
  const int n = first.dynamics.n_inputs(), m = first.dynamics.n_outputs();
  Vector x(n), weights(m), y(m), y_again(m);
  for (auto& value : x) value = uniform(generator);
  for (auto& value : weights) value = uniform(generator);
  Matrix H(n, n), H_again(n, n);
  first.dynamics.evaluate(x.data(), y.data());
  first.dynamics.hessian(x.data(), weights.data(), H.data());
  for (int k = 0; k < 5; ++k) {
    const PlantFunctions again = plant_functions(*problem, 0);
    again.dynamics.evaluate(x.data(), y_again.data());
    again.dynamics.hessian(x.data(), weights.data(), H_again.data());
    EXPECT_EQ(y, y_again);
    EXPECT_EQ(H, H_again);
  }
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

TEST(TimeSteppingTranscription, HasExactDerivatives) {
  expect_exact_derivatives("discs", {.steps = 2, .equations = {}});
  expect_exact_derivatives("three_boxes", {.steps = 1, .equations = {}});  // restitution
  expect_exact_derivatives("cart_pole_friction", {.steps = 2, .equations = {.cone = TS::Cone::squared}});
  expect_exact_derivatives("hopper", {.steps = 2, .equations = {.cone = TS::Cone::polyhedral}});
}

/// A step of the pivoting solver as the guess of the same step as an MPCC.
struct GuessedStep {
  /// @param before  when the step begins, a number of its lengths H
  GuessedStep(const std::string& id, const ButcherTableau& tableau, double before, double H, E::Options options)
      : plant(id[0] == 'P' ? ground_truth_problem(id) : make_problem(id)),
        pivoting(*plant, tableau, {.n_fe = 2}, counters) {
    pivoting.start(plant->info().q0, plant->info().v0);
    const int steps = static_cast<int>(std::lround(before / H));
    for (int k = 0; k < steps; ++k) EXPECT_EQ(pivoting.advance(H), Status::success) << id;
    const Vector q = steps > 0 ? pivoting.step().last().q1 : plant->info().q0;
    const Vector v = steps > 0 ? pivoting.step().last().v1 : plant->info().v0;
    EXPECT_EQ(pivoting.advance(H), Status::success) << id;

    options.shortest = 1e-3;
    equations = std::make_unique<E>(*plant, tableau, options, mpcc);
    equations->add_interval(equations->add_initial_state(q, v), {}, H, -1, 1);
    equations->set_guess(pivoting.step(), 0);
    x.resize(mpcc.nlp.n_variables());
    for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = mpcc.nlp.variables[k].guess;
  }

  const std::unique_ptr<Problem> plant;
  Counters counters;
  PivotingSolver pivoting;
  Mpcc mpcc;
  std::unique_ptr<E> equations;
  Vector x;
};

/// How far the guess is from a solution, and the solution that the homotopy finds from it.
void expect_same_step(const std::string& id, double before, double H, const E::Options& options) {
  const GuessedStep guess(id, make_tableau("radau-iia", 3), before, H, options);
  NlpEvaluator evaluator(guess.mpcc.nlp);
  const auto violation = evaluator.worst_violation(guess.x.data());
  // Rounding of the springs' forces, 1e4 N.
  EXPECT_LE(violation.value, 1e-11) << id << ": " << violation.name;
  const auto product = complementarity(guess.mpcc, guess.x.data());
  EXPECT_LE(product.value, 1e-12) << id << ": " << product.name;

  const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-8}).solve(guess.mpcc);
  ASSERT_TRUE(s.succeeded()) << id << ": " << s.message;
  const FesdStep step = guess.equations->read(s.x, 0);
  EXPECT_LE((step.last().q1 - guess.pivoting.step().last().q1).cwiseAbs().maxCoeff(), 1e-8) << id;
  EXPECT_LE((step.last().v1 - guess.pivoting.step().last().v1).cwiseAbs().maxCoeff(), 1e-8) << id;
}

TEST(FesdEquations, AreThoseThatThePivotingSolverSolves) {
  for (const auto impulses : {E::Impulses::position_velocity, E::Impulses::slack}) {
    expect_same_step("two_balls_spring", 0.40, 0.01, {.impulses = impulses});  // the first impact, at 0.40386 s
    expect_same_step("P3_sliding_block", 0.0, 0.1, {.impulses = impulses});
  }
  for (const auto cone : {E::Cone::exact, E::Cone::polyhedral})
    expect_same_step("P5_slip_reversal", 0.0, 0.1, {.cone = cone});
  expect_same_step("shaken_table", 0.21, 0.01, {});  // an impact with a table that moves, at 0.21367 s
  for (const auto cone : {E::Cone::exact, E::Cone::polyhedral})
    expect_same_step("belt_oscillator", 0.0, 0.1, {.cone = cone});
  expect_same_step("block_on_ramp_3d", 0.0, 0.1, {});
}

/// (8): two elements are equally long unless something switches between them.
TEST(FesdEquations, LengthsAreFreeAtASwitchOnly) {
  struct Case {
    const char* id;
    double before, H;
    bool switches;
  };
  for (const auto& [id, before, H, switches] :
       {Case{"bouncing_ball", 0, 0.01, false}, Case{"P3_sliding_block", 0, 0.1, false},
        Case{"two_balls_spring", 0.40, 0.01, true}}) {
    GuessedStep step(id, make_tableau("radau-iia", 2), before, H, {.equilibration = E::Equilibration::exact});
    const Nlp& nlp = step.mpcc.nlp;
    NlpEvaluator evaluator(nlp);
    const auto row = [&](const std::string& name) {
      Vector values(nlp.n_rows());
      evaluator.constraints(step.x.data(), values.data());
      return values[std::ranges::find_if(nlp.rows, [&](const auto& r) { return r.name.ends_with(name); }) -
                    nlp.rows.begin()];
    };
    const auto nu = std::ranges::find_if(nlp.variables, [](const auto& v) { return v.name.ends_with("indicator"); });
    ASSERT_NE(nu, nlp.variables.end());
    double& indicator = step.x[nu - nlp.variables.begin()];
    indicator = 0;
    indicator = row("indicator[0]");
    if (switches)
      EXPECT_NEAR(indicator, 0, 1e-12) << id << ": the gap is rounding";
    else
      EXPECT_GT(indicator, 1e-3) << id;
    EXPECT_NEAR(row("step equilibration[0]"), 0, 1e-14) << id;
    const auto& elements = step.equations->intervals()[0];
    step.x[elements[0].h] -= 1e-3;
    step.x[elements[1].h] += 1e-3;
    EXPECT_NEAR(std::abs(row("step equilibration[0]")), 2e-3 * indicator, with_rounding(0) * (1 + indicator)) << id;
  }
}

/// (4): at the left end, at the stages, and at a right end that is none of them.
TEST(FesdEquations, AForceExcludesAGapInTheWholeElement) {
  for (const char* family : {"radau-iia", "gauss"}) {
    for (const auto cross :
         {E::CrossComplementarity::sparse, E::CrossComplementarity::per_stage, E::CrossComplementarity::aggregated}) {
      GuessedStep step("P3_sliding_block", make_tableau(family, 2), 0, 0.1, {.cross = cross});
      const auto product = [&] { return complementarity(step.mpcc, step.x.data()).value; };
      EXPECT_LE(product(), 1e-12) << family;
      for (const auto& element : step.equations->intervals()[0]) {
        std::vector<int> gaps = {element.left.gap[0], element.right.gap[0]};
        for (const auto& stage : element.stages) gaps.push_back(stage.point.gap[0]);
        for (const int gap : gaps) {
          const double before = std::exchange(step.x[gap], 1e-3);
          EXPECT_GE(product(), 1e-3) << family << ": " << step.mpcc.nlp.variables[gap].name;
          step.x[gap] = before;
        }
      }
    }
  }
}

/// Opens what only transcriptions use.
struct OpenTranscription : Transcription {
  using Transcription::mean_forces;
};

/// M (v_1 - v_0) = H (f + J_n lambda_n + J_t lambda_t) with the means over a step, impacts included.
TEST(Transcription, MeanForcesAreThoseOfTheMomentum) {
  for (const char* family : {"radau-iia", "gauss"}) {
    const auto plant = make_problem("oblique_impact");
    const ProblemInfo& info = plant->info();
    const ButcherTableau tableau = make_tableau(family, 2);
    Counters counters;
    PivotingSolver solver(*plant, tableau, {.as_needed = true}, counters);
    solver.start(info.q0, info.v0);
    const double H = info.end_time / 10;
    int impacts = 0;
    for (int k = 0; k < 10; ++k) {
      const Vector v_0 = k == 0 ? info.v0 : solver.step().last().v1;
      ASSERT_EQ(solver.advance(H), Status::success) << solver.failure_message();
      const FesdStep& step = solver.step();
      const auto mean = OpenTranscription::mean_forces(step, tableau);
      const Vector &q = step.last().q1, &v = step.last().v1;
      const Vector force =
          plant->force(q, v) + plant->normal_jacobian(q) * mean.lambda_n + plant->tangent_jacobian(q) * mean.lambda_t;
      // An impulse is divided by H and multiplied again.
      EXPECT_LE((plant->mass_matrix(q) * (v - v_0) - H * force).cwiseAbs().maxCoeff(), 1e-13) << family << " " << k;
      impacts += step.Lambda_n.leftCols(step.n_elements).maxCoeff() > 0;
    }
    EXPECT_GT(impacts, 0);
  }
}

/// Path constraints hold where the discs are outside of the obstacle, and break for the one that is inside.
void expect_path_around_the_obstacle(const Transcription& transcription) {
  const Nlp& nlp = transcription.mpcc().nlp;
  Vector x(nlp.n_variables());
  for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = nlp.variables[k].guess;
  NlpEvaluator evaluator(nlp);
  const auto violation = [&](const std::string& constraint) {
    Vector values(nlp.n_rows());
    evaluator.constraints(x.data(), values.data());
    double worst = 0;
    int count = 0;
    for (std::size_t k = 0; k < nlp.rows.size(); ++k) {
      if (!nlp.rows[k].name.ends_with(constraint)) continue;
      const double value = values[static_cast<Eigen::Index>(k)];
      worst = std::max({worst, nlp.rows[k].lower - value, value - nlp.rows[k].upper});
      ++count;
    }
    EXPECT_GT(count, 0) << constraint;
    return worst;
  };
  EXPECT_EQ(violation("obstacle, disc 1"), 0);
  EXPECT_EQ(violation("obstacle, disc 2"), 0);
  for (std::size_t k = 0; k < nlp.variables.size(); ++k) {
    if (nlp.variables[k].name.ends_with(", q[0]")) x[static_cast<Eigen::Index>(k)] = 0;
  }
  EXPECT_NEAR(violation("obstacle, disc 1"), 1.3 * 1.3, 1e-14) << "it lies in the middle, instead of a disc away";
  EXPECT_EQ(violation("obstacle, disc 2"), 0);
}

TEST(Transcription, PathConstraintsKeepDiscsOffAnObstacle) {
  const auto problem = make_control_problem("discs");
  problem->n_intervals = 1;
  expect_path_around_the_obstacle(FesdTranscription(*problem, make_tableau("radau-iia", 2), {}));
  expect_path_around_the_obstacle(TimeSteppingTranscription(*problem, {.steps = 2, .equations = {}}));
}

/// Every step of a simulation with Moreau-Jean, theta = 1, as the guess of the same step as an MPCC. The forces are
/// those that explain the change of velocity.
void expect_moreau_jean(const std::string& id, int n_steps) {
  const auto plant = make_problem(id);
  const ProblemInfo& info = plant->info();
  Settings settings;
  settings.steps = n_steps;
  settings.recording = Recording::grid;
  const Solution motion = make_method("moreau_jean,theta=1")->solve(*plant, settings);
  ASSERT_TRUE(motion.succeeded()) << id << ": " << motion.message;
  const double h = info.end_time / n_steps;

  Vector q = info.q0, v = info.v0;
  int pressed = 0;
  for (const auto& sample : motion.samples) {
    Mpcc mpcc;
    TS equations(*plant, {.law = TS::Law::velocity}, mpcc);
    equations.add_step(equations.add_initial_state(q, v), {}, mpcc.nlp.add_variable(h, h, h, "h"));
    Matrix J(info.n_q, info.n_c() + info.n_lambda_t);
    J << plant->normal_jacobian(sample.q), plant->tangent_jacobian(sample.q);
    const Vector w = (sample.v_plus - v) / h;
    const Vector lambda =
        J.colPivHouseholderQr().solve(plant->mass_matrix(sample.q) * w - plant->force(sample.q, sample.v_plus));
    equations.set_guess(0, h, q, v, sample.q, sample.v_plus, lambda.head(info.n_c()), lambda.tail(info.n_lambda_t));
    pressed += lambda.head(info.n_c()).maxCoeff() > 1e-6;
    Vector x(mpcc.nlp.n_variables());
    for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = mpcc.nlp.variables[k].guess;
    NlpEvaluator evaluator(mpcc.nlp);
    const auto violation = evaluator.worst_violation(x.data());
    // A velocity is divided by h = 1e-3 s and more: rounding of 1e-16 becomes 1e-13, times masses and stiffnesses.
    ASSERT_LE(violation.value, 1e-9) << id << " at " << sample.t << ": " << violation.name;
    ASSERT_LE(complementarity(mpcc, x.data()).value, 1e-9)
        << id << " at " << sample.t << ": " << complementarity(mpcc, x.data()).name;
    q = sample.q;
    v = sample.v_plus;
  }
  EXPECT_GT(pressed, 0) << id;
}

TEST(TimeSteppingEquations, AreThoseOfMoreauJean) {
  expect_moreau_jean("bouncing_ball", 300);
  expect_moreau_jean("two_balls_spring", 500);
  expect_moreau_jean("sliding_block", 50);
  expect_moreau_jean("oblique_impact", 50);
}

TEST(TimeSteppingEquations, LandAtTheEndOfAStep) {
  // A ball that would penetrate the floor within the step ends on it: gap 0, v = -height / h, m (v - v_0) = h (lambda -
  // m g).
  const auto plant = make_problem("bouncing_ball", {{"e", 0}});
  const double radius = -plant->gap(Vector::Zero(1))[0], height = 0.01, q_0 = radius + height, v_0 = -2, h = 0.02;
  Mpcc mpcc;
  TS equations(*plant, {}, mpcc);
  equations.add_step(equations.add_initial_state(Vector::Constant(1, q_0), Vector::Constant(1, v_0)), {},
                     mpcc.nlp.add_variable(h, h, h, "h"));
  const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-8}).solve(mpcc);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const double m = plant->mass_matrix(plant->info().q0)(0, 0), v = -height / h;
  const double load = m * (v - v_0) - h * plant->force(plant->info().q0, plant->info().v0)[0];
  EXPECT_NEAR(equations.position(s.x, 0)[0], radius, 1e-10);
  EXPECT_NEAR(equations.velocity(s.x, 0)[0], v, 1e-8);
  EXPECT_NEAR(equations.normal_impulse(s.x, 0)[0], load, 1e-8);
  EXPECT_THROW(TS(*make_problem("bouncing_ball", {{"e", 0.5}}), {.law = TS::Law::position}, mpcc), InputError);
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
  EXPECT_FALSE(control_problems().empty());
  for (const auto& entry : control_problems()) EXPECT_NO_THROW(validate(*make_control_problem(entry.id))) << entry.id;
}

TEST(OptimalControl, PlantFollowsTheSolution) {
  const auto problem = make_control_problem("two_carts");
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 3),
                                  {.cross = E::CrossComplementarity::aggregated});
  ASSERT_EQ(transcription.guess_from_simulation(), Status::success);
  const MpccSolution s = Homotopy({.sigma_0 = 1e-2, .sigma_final = 1e-6}).solve(transcription.mpcc());
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LE(s.complementarity, 1e-12);
  EXPECT_LE(s.violation.value, 1e-9);
  const ControlTrajectory trajectory = transcription.trajectory(s.x);
  EXPECT_LE(trajectory.objective, 100) << "1020 is the cost of doing nothing";
  EXPECT_NEAR(trajectory.objective, s.objective, 1e-2 * s.objective) << "but for the equilibration of the steps";
  for (const auto& solve : {reference_solver(1e-11), pivoting_solver(1e-9)}) {
    const Replay truth = replay(*problem, trajectory, solve);
    ASSERT_EQ(truth.status, Status::success) << truth.message;
    const ReplayMismatch difference = mismatch(*problem, trajectory, truth);
    // A claim is true here when its replay ends within 1e-5 of it, far below what a controller could tell.
    EXPECT_LE(difference.terminal, 1e-5);
    EXPECT_LE(difference.events, 1e-5);
    EXPECT_LE(std::abs(difference.cost), 1e-5 * truth.cost);
  }
}

HomotopyOptions carts_homotopy() {
  return ControlOptions::parse("two_carts --sigma-0 0.01").homotopy_options();
}

/// Solves two_carts, lets the plant run an interval at a time and plans again after each, up to `updates`.
void follow_carts(Transcription& transcription, const OptimalControlProblem& problem, double disturbance, int updates,
                  const std::function<void(const ShrinkingHorizon&, const MpccSolution&)>& check) {
  ASSERT_EQ(transcription.guess_from_simulation(), Status::success);
  HomotopyControlSolver solver(transcription, carts_homotopy());
  ShrinkingHorizon horizon(problem, solver);
  const ControlSolution first = horizon.solve();
  ASSERT_TRUE(first.succeeded()) << first.message;
  std::mt19937 random(1);
  Matrix given(problem.plant->info().n_u, updates);
  for (int k = 1; k <= updates; ++k) {
    given.col(k - 1) = horizon.plan().u.col(k - 1);
    ASSERT_EQ(horizon.advance(), Status::success);
    if (disturbance > 0) horizon.disturb(disturbance, random);
    EXPECT_EQ(horizon.resolve().status, solver.last().status);
    check(horizon, solver.last());
    EXPECT_EQ(horizon.plan().u.leftCols(k), given.leftCols(k)) << "what the plant was given is past";
  }
}

/// The guess puts an impact where the program's least length of an element holds it: the plant's cost falls to 10.51 from
/// there, and the point is not called stationary for the plant.
TEST(OptimalControl, ElementsAtTheirLeastLengthAreReported) {
  const auto problem = make_control_problem("two_carts");
  FesdTranscription transcription(*problem, tableau_argument(problem->tableau), {});
  ASSERT_EQ(transcription.guess_from_simulation(), Status::success);
  const MpccSolution of_program =
      Homotopy(ControlOptions::parse("two_carts --sigma-0 0.01").homotopy_options()).solve(transcription.mpcc());
  ASSERT_TRUE(of_program.succeeded()) << of_program.message;
  const std::string stationarity = transcription.stationarity(of_program);
  const double shortest = 0.1 * problem->plant->info().end_time / problem->n_intervals / problem->n_fe;
  int at_bound = 0;
  for (std::size_t k = 0; k < transcription.mpcc().nlp.variables.size(); ++k) {
    const auto& variable = transcription.mpcc().nlp.variables[k];
    at_bound += variable.name.ends_with(", h") && of_program.x[static_cast<Eigen::Index>(k)] <= (1 + 1e-6) * shortest;
  }
  EXPECT_EQ(stationarity.find("unknown for the plant") != std::string::npos, at_bound > 0) << stationarity;
}

TEST(ShrinkingHorizon, TheRestOfAnOptimalPlanIsOptimal) {
  const auto problem = make_control_problem("two_carts");
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 3),
                                  {.cross = E::CrossComplementarity::aggregated});
  double whole = 0;
  follow_carts(transcription, *problem, 0, 8, [&](const ShrinkingHorizon& horizon, const MpccSolution& again) {
    ASSERT_TRUE(again.succeeded()) << again.message;
    EXPECT_TRUE(again.kept_branch) << horizon.interval();
    EXPECT_LE(again.iterations, 10) << "Newton's method at its solution; a homotopy takes about a hundred";
    const double total = horizon.cost_so_far() + horizon.cost_to_go();
    if (whole > 0) EXPECT_NEAR(total, whole, 1e-6 * whole) << "the plant follows the plan to 1e-8";
    whole = total;
  });
}

TEST(ShrinkingHorizon, StartsWhereThePlantIs) {
  const auto problem = make_control_problem("two_carts");
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 3),
                                  {.cross = E::CrossComplementarity::aggregated});
  NlpEvaluator evaluator(transcription.mpcc().nlp);
  follow_carts(transcription, *problem, 0.01, 3, [&](const ShrinkingHorizon& horizon, const MpccSolution& again) {
    ASSERT_TRUE(again.succeeded()) << again.message;
    EXPECT_LE(complementarity(transcription.mpcc(), again.x.data()).value, 0);
    EXPECT_LE(evaluator.worst_violation(again.x.data()).value, 1e-9) << "solved to 1e-10";
    // The end of the last interval before, as the first point of the rest has it.
    const double t = horizon.interval() * horizon.plan().T / problem->n_intervals;
    double distance = kInfinity;
    for (const auto& point : horizon.plan().points) {
      if (std::abs(point.t - t) < 1e-9) distance = std::min(distance, (point.q - horizon.q()).norm());
    }
    EXPECT_LE(distance, 1e-9) << "solved to 1e-10; the plant was moved by up to 1e-2";
  });
}

TEST(ShrinkingHorizon, WithoutTimeThePlanStaysInForce) {
  const auto problem = make_control_problem("two_carts");
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 3),
                                  {.cross = E::CrossComplementarity::aggregated});
  ASSERT_EQ(transcription.guess_from_simulation(), Status::success);
  HomotopyOptions options = carts_homotopy();
  options.warm_time_limit = 1e-6;
  HomotopyControlSolver solver(transcription, options);
  ShrinkingHorizon horizon(*problem, solver);
  ASSERT_TRUE(horizon.solve().succeeded());
  const Matrix u = horizon.plan().u;
  ASSERT_EQ(horizon.advance(), Status::success);
  const ControlSolution again = horizon.resolve();
  EXPECT_EQ(again.status, Status::time_limit) << again.message;
  EXPECT_FALSE(again.has_plan());
  EXPECT_EQ(horizon.plan().u, u);
  EXPECT_EQ(horizon.advance(), Status::success);
}

TEST(ShrinkingHorizon, OfTimeStepping) {
  const auto problem = make_control_problem("two_carts");
  TimeSteppingTranscription transcription(*problem, {.steps = 4});
  follow_carts(transcription, *problem, 0, 2, [&](const ShrinkingHorizon& horizon, const MpccSolution& again) {
    ASSERT_TRUE(again.succeeded()) << again.message;
    EXPECT_LE(again.violation.value, 1e-9) << horizon.interval() << ", solved to 1e-10";
  });
}

TEST(Exploration, FindsTheContactsThatNoSmallChangeFinds) {
  const auto problem = make_control_problem("three_boxes");
  const ButcherTableau tableau = make_tableau("radau-iia", 2);
  RolloutRunner runner(*problem, tableau, problem->n_fe);
  const Matrix still = Matrix::Zero(1, problem->n_intervals);
  const Rollout at_rest = runner.run(still);
  ASSERT_EQ(at_rest.status, Status::success);
  // The boxes stay 4 and 3 from their goals: 10 (4^2 + 3^2) for 6 s, and 100 times that at the end.
  EXPECT_NEAR(at_rest.cost, 250 * (6 + 100), 1e-8);
  EXPECT_EQ(at_rest.violation, 0);
  // Dry friction holds the driven box against 1.9 N.
  const Rollout pushed = runner.run(still.array() + 1.9);
  EXPECT_NEAR(pushed.cost - at_rest.cost, 6 * 1.9 * 1.9 / 10, 1e-8);

  const ExplorationOptions options{.rounds = 8, .samples = 60, .elite = 10};
  const ExplorationResult found = explore(*problem, tableau, problem->n_fe, options);
  EXPECT_EQ(found.rollouts, 481);
  EXPECT_LT(found.rollout.cost, 0.5 * at_rest.cost) << "at least one box was pushed";
  const Rollout again = RolloutRunner(*problem, tableau, problem->n_fe).run(found.u);
  EXPECT_EQ(again.cost, found.rollout.cost);
  EXPECT_THROW(explore(*problem, tableau, problem->n_fe, {.samples = 10, .elite = 11}), InputError);
}

TEST(Exploration, RolloutSaysHowFarItGot) {
  auto problem = make_control_problem("three_boxes");
  problem->q.upper[2] = 0.1;  // of the driven box
  const Matrix u = Matrix::Constant(1, problem->n_intervals, 3);
  const Rollout rollout = RolloutRunner(*problem, make_tableau("radau-iia", 2), problem->n_fe).run(u);
  EXPECT_GT(rollout.violation, 0);
  EXPECT_EQ(rollout.n_solved == problem->n_intervals, rollout.status == Status::success);
}

TEST(ControlGradient, IsThatOfThePlantThroughAnImpact) {
  const auto problem = make_control_problem("two_carts");
  ControlTrajectory trajectory;
  trajectory.T = problem->plant->info().end_time;
  trajectory.u.resize(1, 5);
  trajectory.u << 4, 3, 1, -1, 0;
  const Matrix truth = gradient_by_differences(*problem, trajectory, reference_solver(1e-12), 1e-3);
  const Replay motion = replay(*problem, trajectory, reference_solver(1e-12));
  EXPECT_TRUE(std::ranges::any_of(motion.events, [](const Event& e) { return e.kind == EventKind::impact; }));
  const Matrix fesd = gradient_by_sensitivities(*problem, trajectory, "fesd:radau-iia:3", 4);
  // Order 5 with 20 steps in all; the reference is good to its tolerance over the change, 1e-9.
  EXPECT_LE((fesd - truth).cwiseAbs().maxCoeff(), 1e-7 * truth.cwiseAbs().maxCoeff());
  // A time-stepping scheme does not move its impact with the controls: no step length helps.
  for (const int steps : {10, 100, 1000}) {
    const Matrix stepped =
        gradient_by_differences(*problem, trajectory, fixed_step_solver("moreau_jean,theta=1", steps), 1e-6);
    EXPECT_GE((stepped - truth).cwiseAbs().maxCoeff(), 0.1 * truth.cwiseAbs().maxCoeff()) << steps;
  }
}

TEST(OptimalControl, AnIntervalThatNeedsMoreElementsIsGuessedToo) {
  // One element per interval does not reach through the impact: its stages are points of the motion.
  const auto problem = make_control_problem("two_carts");
  problem->n_fe = 1;
  FesdTranscription transcription(*problem, make_tableau("radau-iia", 3), {.n_fe = 1});
  ASSERT_EQ(transcription.guess_from_simulation(), Status::success);
  const Nlp& nlp = transcription.mpcc().nlp;
  Vector x(nlp.n_variables());
  for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = nlp.variables[k].guess;
  const ControlTrajectory guess = transcription.trajectory(x);
  const Replay truth = replay(*problem, guess, reference_solver(1e-11));
  ASSERT_EQ(truth.status, Status::success) << truth.message;
  EXPECT_TRUE(std::ranges::any_of(truth.events, [](const Event& e) { return e.kind == EventKind::impact; }));
  EXPECT_LE(mismatch(*problem, guess, truth).terminal, 1e-5);  // order 5 with elements of 0.2 s
}

TEST(OptimalControl, TimeSteppingIsAGuess) {
  // Its controls do not do what it claims; FESD-J, started from the motion under them, does.
  const auto problem = make_control_problem("push_box_goal");
  HomotopyOptions settings = ControlOptions().homotopy;
  settings.sigma_0 = 1e-2;
  settings.max_branches = 0;
  const Homotopy homotopy(settings);
  TimeSteppingTranscription stepped(*problem, {.steps = 6, .equations = {}});
  ASSERT_EQ(stepped.guess_from_simulation(), Status::success);
  const MpccSolution guess = homotopy.solve(stepped.mpcc());
  ASSERT_TRUE(guess.succeeded()) << guess.message;
  const ControlTrajectory claimed = stepped.trajectory(guess.x);
  const Replay plain = replay(*problem, claimed, reference_solver(1e-11));
  ASSERT_EQ(plain.status, Status::success) << plain.message;
  EXPECT_GE(mismatch(*problem, claimed, plain).terminal, 1e-2);

  FesdTranscription transcription(*problem, make_tableau("radau-iia", 2),
                                  {.cross = E::CrossComplementarity::aggregated});
  ASSERT_EQ(transcription.guess_from_simulation(claimed.u), Status::success);
  const MpccSolution s = homotopy.solve(transcription.mpcc());
  ASSERT_TRUE(s.succeeded()) << s.message;
  const ControlTrajectory trajectory = transcription.trajectory(s.x);
  EXPECT_LE(trajectory.objective, 5) << "15.5 is the local optimum near a constant push";
  const Replay truth = replay(*problem, trajectory, reference_solver(1e-11));
  ASSERT_EQ(truth.status, Status::success) << truth.message;
  EXPECT_LE(mismatch(*problem, trajectory, truth).terminal, 1e-5);  // so the claim is true
}

}  // namespace
}  // namespace ricochet
