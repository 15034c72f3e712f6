// Optimal control problems as files: what is written is read back, files are solved, and mistakes name their place.
#include "problems/scene_file/control_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "bench/control/replay.h"
#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/exploration.h"
#include "methods/control/fesd_transcription.h"
#include "methods/control/shooting/convex_hessian.h"
#include "methods/control/shooting/shooting.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/control/controls_csv.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// A mass on rails that is free to move, with a floor that it does not reach.
json free_mass() {
  return json::parse(R"({
    "params": {"m": "2", "rate": "3"},
    "q0": ["0"], "v0": ["0"], "T": "2", "M": [["m"]], "f": ["0"], "Bu": [["1"]], "u": ["0"],
    "contacts": [{"gap": "q[0] + 100"}],
    "control": {
      "N": 4, "names": ["push"], "running_cost": "(push - rate*t)**2/2",
      "bounds": {"q": [["-50", null]], "v": [[null, null]], "u": [["-20", "20"]]}
    }
  })");
}

std::string control_error_of(const json& scene) {
  try {
    read_control_text(scene.dump(), "f");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// The message about free_mass() after a `change`.
template <class Change>
std::string error_after(Change change) {
  json scene = free_mass();
  change(scene);
  return control_error_of(scene);
}

ControlSolution shoot(const OptimalControlProblem& problem, const std::vector<Matrix>& guesses) {
  return Shooting(problem, tableau_argument(problem.tableau), {}).solve(guesses, problem.plant->info().end_time);
}

std::vector<Matrix> explored(const OptimalControlProblem& problem) {
  return explore(problem, tableau_argument(problem.tableau), problem.n_fe, {.rounds = 12, .starts = 2}).starts;
}

void expect_replay_as_claimed(const OptimalControlProblem& problem, const ControlTrajectory& claim, double tolerance) {
  const Replay truth = replay(problem, claim, reference_solver(1e-11));
  ASSERT_EQ(truth.status, Status::success) << truth.message;
  const ReplayMismatch difference = mismatch(problem, claim, truth);
  EXPECT_LE(difference.terminal, tolerance);
  EXPECT_LE(std::abs(difference.cost), tolerance * std::max(1.0, std::abs(claim.objective)));
}

TEST(ControlFile, EveryCompiledProblemIsWrittenAndReadBack) {
  std::mt19937 random(45);
  std::uniform_real_distribution<double> uniform(0.5, 1);
  ASSERT_GE(control_problems().size(), 7U);
  for (const auto& entry : control_problems()) {
    const auto problem = make_control_problem(entry.id);
    const std::string text = control_text(*problem);
    const auto again = read_control_text(text, "f");
    EXPECT_EQ(json::parse(control_text(*again)), json::parse(text)) << entry.id;
    EXPECT_EQ(again->id, entry.id);
    for (const auto bounds : {&OptimalControlProblem::q, &OptimalControlProblem::v, &OptimalControlProblem::u}) {
      EXPECT_EQ(((*again).*bounds).lower, ((*problem).*bounds).lower) << entry.id;
      EXPECT_EQ(((*again).*bounds).upper, ((*problem).*bounds).upper) << entry.id;
    }
    EXPECT_EQ(again->goal, problem->goal) << entry.id;
    EXPECT_EQ(again->is_time_free, problem->is_time_free) << entry.id;
    EXPECT_EQ(again->T_lower, problem->T_lower) << entry.id;
    EXPECT_EQ(again->guess(3), problem->guess(3)) << entry.id;
    for (const auto function : {&OptimalControlProblem::running_cost, &OptimalControlProblem::terminal_cost,
                                &OptimalControlProblem::path, &OptimalControlProblem::terminal}) {
      const SmoothFunction &read = (*again).*function, &stated = (*problem).*function;
      ASSERT_EQ(read.n_outputs(), stated.n_outputs()) << entry.id;
      if (stated.n_outputs() == 0) continue;
      const Vector x = Vector::NullaryExpr(stated.n_inputs(), [&] { return uniform(random); });
      const Vector value = stated.at(x);
      // terms in another order
      EXPECT_LE((read.at(x) - value).cwiseAbs().maxCoeff(), 1e-13 * (1 + value.cwiseAbs().maxCoeff())) << entry.id;
    }
  }
}

TEST(ControlFile, AWrittenProblemHasTheSameOptimum) {
  for (const char* id : {"two_carts", "push_box_goal"}) {
    const auto problem = make_control_problem(id);
    const auto again = read_control_text(control_text(*problem), "f");
    const auto guesses = explored(*problem);
    const ControlSolution stated = shoot(*problem, guesses), read = shoot(*again, guesses);
    ASSERT_TRUE(stated.succeeded()) << id << ": " << stated.message;
    ASSERT_TRUE(read.succeeded()) << id << ": " << read.message;
    // where the iteration ends: costs are flat there, and its last step is of 1e-12
    EXPECT_NEAR(read.trajectory.objective, stated.trajectory.objective, 1e-11 * stated.trajectory.objective) << id;
    EXPECT_LE((read.trajectory.u - stated.trajectory.u).cwiseAbs().maxCoeff(), 1e-6) << id;
    EXPECT_EQ(read.stationarity, stated.stationarity) << id;
  }
}

/// (push - rate t)^2 has its optimum at the mean of rate t in every interval: the value at the middle. The rest is the
/// variance, rate^2 H^3 / 24 in each.
TEST(ControlFile, CostsMayDependOnTime) {
  const auto problem = read_control_text(free_mass().dump(), "f");
  EXPECT_EQ(problem->plant->info().clock, 1);
  const double H = 0.5, cost = 4 * 9 * H * H * H / 24;
  const Matrix expected{{0.75, 2.25, 3.75, 5.25}};
  const ControlSolution shooting = shoot(*problem, {problem->guess(4)});
  ASSERT_TRUE(shooting.succeeded()) << shooting.message;
  EXPECT_LE((shooting.trajectory.u - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(shooting.trajectory.objective, cost, 1e-12);
  expect_replay_as_claimed(*problem, shooting.trajectory, 1e-9);

  FesdTranscription transcription(*problem, tableau_argument(problem->tableau), {});
  const MpccSolution homotopy = Homotopy({}).solve(transcription.mpcc());
  ASSERT_TRUE(homotopy.succeeded()) << homotopy.message;
  const ControlTrajectory trajectory = transcription.trajectory(homotopy.x);
  EXPECT_LE((trajectory.u - expected).cwiseAbs().maxCoeff(), 1e-6);  // of Ipopt
  expect_replay_as_claimed(*problem, trajectory, 1e-6);
}

/// A constraint u >= rate t at the stages binds at the end of every interval.
TEST(ControlFile, ConstraintsMayDependOnTime) {
  json scene = free_mass();
  scene["control"]["path"] = json::parse(R"([{"name": "ahead", "value": "push - rate*t"}])");
  const auto problem = read_control_text(scene.dump(), "f");
  const ControlSolution solution = shoot(*problem, {Matrix::Constant(1, 4, 10)});
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  EXPECT_LE((solution.trajectory.u - Matrix{{1.5, 3, 4.5, 6}}).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(ControlFile, AGuessIsConstantOrATable) {
  json scene = free_mass();
  scene["u"] = {"rate"};
  EXPECT_EQ(read_control_text(scene.dump(), "f")->guess(2), (Matrix{{3, 3}}));
  scene["control"]["guess"] = {"-rate"};
  EXPECT_EQ(read_control_text(scene.dump(), "f")->guess(2), (Matrix{{-3, -3}}));
  scene["control"]["guess"] = json::parse(R"([["rate"], [1], [2], ["-4"]])");
  const auto problem = read_control_text(scene.dump(), "f");
  EXPECT_EQ(problem->guess(4), (Matrix{{3, 1, 2, -4}}));
  EXPECT_EQ(problem->guess(2), (Matrix{{1, -4}}));
  EXPECT_EQ(problem->guess(8), (Matrix{{3, 3, 1, 1, 2, 2, -4, -4}}));
  EXPECT_EQ(read_control_text(control_text(*problem), "f")->guess(4), problem->guess(4));
  const FesdTranscription transcription(*problem, tableau_argument(problem->tableau), {});
  std::vector<double> guesses;
  for (const auto& variable : transcription.mpcc().nlp.variables) {
    if (variable.name.find("u[0]") != std::string::npos) guesses.push_back(variable.guess);
  }
  EXPECT_EQ(guesses, (std::vector<double>{3, 1, 2, -4}));
  EXPECT_EQ(read_control_text(scene.dump(), "f", {{"rate", 5}})->guess(4)(0, 0), 5);
}

TEST(ControlFile, AGuessIsATableOfAnyLengthInAFileBesideTheProblem) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "control_guess";
  std::filesystem::create_directories(folder);
  json scene = free_mass();
  scene["control"]["guess"] = "plan.csv";
  const auto write = [&](const std::string& text) { std::ofstream(folder / "plan.csv") << text; };
  const auto read = [&] {
    std::ofstream(folder / "problem.json") << scene.dump();
    return read_control_file((folder / "problem.json").string());
  };
  const Matrix plan{{3, -4.5}};
  write("# of an earlier solution\n" + controls_csv(plan, 1));
  EXPECT_EQ(read()->guess(4), (Matrix{{3, 3, -4.5, -4.5}}));
  EXPECT_EQ(read()->plant->info().u[0], 3);
  write("push\n3\n\n-4.5\n");
  EXPECT_EQ(read()->guess(2), plan);
  for (const auto& [text, reason] :
       {std::pair("push\n3\nx\n", "plan.csv, line 3"), std::pair("push\n3,4\n", "one for each of 1"),
        std::pair("push\n", "no rows"), std::pair("push\n30\n", "in the bounds")}) {
    write(text);
    try {
      read();
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
}

/// Squares are the same problem as their formula, and their convex part is the one of Gauss and Newton.
TEST(ControlFile, SquaresAreAddedToTheCost) {
  json scene = free_mass();
  scene["control"]["running_cost"] = "push**2/8 - q[0]**2/100";
  scene["control"]["running_squares"] =
      json::parse(R"~([{"value": "sin(q[0])", "reference": "rate*t", "weight": "m"}, {"value": "v[0]"}])~");
  scene["control"]["terminal_squares"] = json::parse(R"([{"value": "q[0]*v[0]", "weight": 5}])");
  const auto problem = read_control_text(scene.dump(), "f");
  const Vector q{{0.3, 0.7}}, v{{-0.4, 1}}, u{{2}};
  EXPECT_NEAR(problem->running_cost.at(q, v, u)[0], 0.5 - 0.0009 + 2 * std::pow(std::sin(0.3) - 3 * 0.7, 2) + 0.16,
              1e-14);
  EXPECT_NEAR(problem->terminal_cost.at(q, v)[0], 5 * 0.12 * 0.12, 1e-14);

  Vector x(5);
  x << q, v, u;
  ConvexHessian hessian(problem->running_cost, problem->running_residuals);
  const Vector slope{{std::cos(0.3), -3}};
  Matrix expected = Matrix::Zero(5, 5);
  expected.topLeftCorner(2, 2) = 2 * 2 * slope * slope.transpose();
  expected(2, 2) = 2;
  expected(4, 4) = 0.25;
  EXPECT_LE((hessian.at(x.data()) - expected).cwiseAbs().maxCoeff(), 1e-13);  // the concave -q^2 / 100 is left out

  const auto again = read_control_text(control_text(*problem), "f");
  EXPECT_EQ(again->running_residuals.n_outputs(), 2);
  ConvexHessian of_written(again->running_cost, again->running_residuals);
  EXPECT_LE((of_written.at(x.data()) - expected).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_NEAR(again->running_cost.at(q, v, u)[0], problem->running_cost.at(q, v, u)[0], 1e-14);
  scene["control"]["running_squares"][0]["weight"] = "-m";
  EXPECT_NE(control_error_of(scene).find("control.running_squares[0].weight"), std::string::npos);
}

/// A mass in the plane goes as far as it can in the direction (3, 4) / 5, with a force of at most 1: F = (3, 4) / 5 all the
/// time, and T^2 / 2 m far. A step along tangents of the circle leaves it by the square of its length.
TEST(ControlFile, ACurvedBoundOfAForceIsFollowed) {
  const auto problem = read_control_text(R"~({
    "q0": ["0", "0"], "v0": ["0", "0"], "T": "2", "M": [["1", "0"], ["0", "1"]], "f": ["0", "0"],
    "Bu": [["1", "0"], ["0", "1"]], "u": ["1", "0"], "contacts": [{"gap": "q[1] + 100"}],
    "control": {"N": 4, "running_cost": "0", "terminal_cost": "-(3*q[0] + 4*q[1])/5",
                "path": [{"value": "1 - u[0]**2 - u[1]**2"}], "bounds": {"u": [["-2", "2"], ["-2", "2"]]}}
  })~",
                                         "f");
  const ControlSolution solution = shoot(*problem, {problem->guess(4)});
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  EXPECT_NEAR(solution.trajectory.objective, -2, 1e-9);
  EXPECT_LE((solution.trajectory.u.colwise() - Vector{{0.6, 0.8}}).cwiseAbs().maxCoeff(), 1e-4);  // the root of 1e-9
  EXPECT_LE(solution.iterations, 40) << "without a correction of second order steps stay short";
}

TEST(ControlFile, TheSceneOfAControlProblemRuns) {
  const auto problem = read_scene_text(free_mass().dump(), "f");
  EXPECT_EQ(problem->info().n_u, 1);
  EXPECT_EQ(problem->info().clock, -1) << "the scene does not depend on time, its costs do";
}

TEST(ControlFile, MistakesNameTheirPlace) {
  const auto in_control = [](const char* field, const char* value) {
    return error_after([&](json& scene) { scene["control"][field] = json::parse(value); });
  };
  EXPECT_EQ(control_error_of(free_mass()), "no error");
  EXPECT_EQ(error_after([](json& scene) { scene.erase("control"); }),
            "f: control: this field is missing, which states the costs and bounds of a control problem");
  EXPECT_EQ(in_control("N", "0"), "f: control.N = 0: a whole number >= 1 and <= 100000 is required");
  EXPECT_EQ(in_control("N", "2.5"), "f: control.N = 2.5: a whole number is required");
  EXPECT_EQ(in_control("elements", "0"), "f: control.elements = 0: a whole number >= 1 and <= 1000 is required");
  EXPECT_EQ(error_after([](json& scene) { scene["control"].erase("running_cost"); }),
            "f: control.running_cost: this field is missing");
  EXPECT_NE(in_control("cost", "\"1\"").find("running_cost"), std::string::npos) << "a near match is proposed";

  // Names
  EXPECT_NE(in_control("running_cost", "\"pull**2\"").find("unknown name 'pull'"), std::string::npos);
  EXPECT_NE(in_control("running_cost", "\"u[1]**2\"").find("f: control.running_cost"), std::string::npos);
  EXPECT_NE(in_control("terminal_cost", "\"u[0]**2\"").find("'u' is not allowed here"), std::string::npos);
  EXPECT_NE(in_control("terminal", R"([{"value": "push"}])").find("f: control.terminal[0].value"), std::string::npos);
  EXPECT_NE(in_control("goal", R"(["q[0]"])").find("f: control.goal[0]"), std::string::npos);
  EXPECT_EQ(in_control("names", R"(["m"])"),
            "f: control.names[0] = m: a parameter or another control has this name; another one is required");
  EXPECT_EQ(in_control("names", R"(["a", "b"])"), "f: control.names, number of entries = 2: 1 are required");
  EXPECT_EQ(in_control("names", R"(["t"])"), "f: control.names[0] = t: t is the time; another name is required");

  // Bounds
  EXPECT_EQ(in_control("bounds", R"({"u": [[1, -1]]})"),
            "f: control.bounds.u[0] = [1, -1]: lower <= upper is required");
  EXPECT_EQ(in_control("bounds", R"({"q": [[1, 2]]})"),
            "f: initial q[0] = 0: a number in its bounds [1, 2] is required");
  EXPECT_EQ(in_control("bounds", R"({"q": [[-1, 2], [-1, 2]]})"),
            "f: control.bounds.q, number of entries = 2: 1 are required");
  EXPECT_EQ(in_control("bounds", R"({"q": [[-1]]})"),
            "f: control.bounds.q[0], number of entries = 1: at least 2 are required");
  EXPECT_EQ(in_control("bounds", R"({"T": [0, 5]})"),
            "f: control.bounds.T = [0, 5]: 0 < lower <= upper is required, both finite");
  EXPECT_EQ(in_control("bounds", R"({"T": [1, null]})"),
            "f: control.bounds.T = [1, inf]: 0 < lower <= upper is required, both finite");
  EXPECT_EQ(in_control("bounds", R"({"T": [3, 5]})"),
            "f: control beside T = 2: a guess in bounds.T, [3, 5], is required");

  // Guesses
  EXPECT_EQ(in_control("guess", R"(["1", "2"])"), "f: control.guess, number of entries = 2: 1 are required");
  EXPECT_EQ(in_control("guess", R"([["1"], ["2"]])"), "f: control.guess, number of entries = 2: 4 are required");
  EXPECT_EQ(in_control("guess", R"([["1"], ["2"], ["3", "4"], ["5"]])"),
            "f: control.guess[2], number of entries = 2: 1 are required");
  EXPECT_EQ(in_control("guess", R"([["1"], "2", ["3"], ["5"]])"),
            "f: control.guess[1] = 2: a row of values is required, as in the first interval");
  EXPECT_EQ(in_control("guess", R"([["1"], ["21"], ["3"], ["5"]])"),
            "f: control.guess[1][0] = 21: a guess in the bounds [-20, 20] of u[0] is required");
  EXPECT_EQ(in_control("guess", "[]"), "f: control.guess, number of entries = 0: 1 are required");

  // Constraints that the start violates, and what no method of optimal control sees
  EXPECT_EQ(in_control("path", R"([{"name": "far", "value": "q[0] - 1"}])"),
            "f: path constraint 'far' at the initial state = -1: a value >= 0 is required");
  EXPECT_NE(error_after([](json& scene) { scene["until"] = "q[0] - 1"; }).find("a control problem ends at T"),
            std::string::npos);
  EXPECT_NE(error_after([](json& scene) { scene["impact_law"] = "poisson"; }).find("newton is required"),
            std::string::npos);
  EXPECT_NE(error_after([](json& scene) { scene["contacts"][0]["e"] = "1/(1 + vn)"; }).find("e as a formula of vn"),
            std::string::npos);
  EXPECT_NE(error_after([](json& scene) { scene["u"] = {"sin(t)"}; }).find("control.guess takes a table"),
            std::string::npos);
  EXPECT_NE(error_after([](json& scene) {
              scene.erase("u");
              scene.erase("Bu");
              scene["control"].erase("names");
            }).find("a scene with Bu and u is required"),
            std::string::npos);
}

TEST(ControlFile, ExamplesAreSolvedAndThePlantFollows) {
  for (const auto& [id, cost] : {std::pair("catch_ball", 0.0458915542), std::pair("feed_block", 0.0988981140)}) {
    const auto problem = make_control_problem(std::string(RICOCHET_EXAMPLES "/control/") + id + ".json");
    const ControlSolution solution = shoot(*problem, {problem->guess(problem->n_intervals)});
    ASSERT_TRUE(solution.succeeded()) << id << ": " << solution.message;
    const auto& end = solution.trajectory.points.back();
    EXPECT_LE((end.q - problem->goal).cwiseAbs().maxCoeff(), 0.03) << id;  // m; costs pull it there
    EXPECT_NEAR(solution.trajectory.objective, cost, 1e-9) << id << ", from here and from a random search";
    EXPECT_LE(solution.violation, 1e-9) << id;
    expect_replay_as_claimed(*problem, solution.trajectory, 1e-12);  // forces are constant between events: no error
  }
}

TEST(ControlFile, ProblemsOfTheLiteratureAreRead) {
  for (const auto& [id, n_c, N] :
       {std::tuple("transport", 1, 40), std::tuple("thrown_ball", 1, 20), std::tuple("ball_in_box", 4, 30)}) {
    const auto problem = make_control_problem(std::string(RICOCHET_EXAMPLES "/control/") + id + ".json");
    EXPECT_EQ(problem->plant->info().n_c(), n_c) << id;
    EXPECT_EQ(problem->n_intervals, N) << id;
  }
}

TEST(ControlFile, APathIsReadWhereANameIsExpected) {
  EXPECT_EQ(make_control_problem(RICOCHET_EXAMPLES "/control/catch_ball.json")->id, "catch_ball");
  EXPECT_THROW(make_control_problem("no/such/file.json"), InputError);
  EXPECT_THROW(make_control_problem(RICOCHET_EXAMPLES "/control/catch_ball.json", {{"mass", 1}}), InputError);
  EXPECT_TRUE(is_control_file(RICOCHET_EXAMPLES "/control/catch_ball.json"));
}

}  // namespace
}  // namespace ricochet
