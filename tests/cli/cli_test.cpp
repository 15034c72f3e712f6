// The program as a user meets it: exit codes, texts, files.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "tests/cli/program.h"
#include "tests/test_data.h"

namespace ricochet::cli {

using namespace std::string_literals;
namespace {

TEST_F(Cli, HelpAndUsage) {
  EXPECT_EQ(run("--help").code, 0);
  EXPECT_EQ(run("").code, 2);
  EXPECT_EQ(run("dance").code, 2);
  EXPECT_EQ(run("run --steps ten -p bouncing_ball -m fesd:gauss:2").code, 2);
  const Outcome list = run("list");
  EXPECT_EQ(list.code, 0);
  for (const char* name : {"two_balls_spring", "pendulum_wall", "fesd", "moreau_jean", "anitescu_potra", "cvode",
                           "two_balls_order", "method_grid", "zeno"})
    EXPECT_HAS(list.text, name);
}

TEST_F(Cli, SaysWhatItIsAndWhatThereIs) {
  EXPECT_HAS(run("--version").text, "ricochet 1.");
  const Outcome mistyped = run("runn");
  EXPECT_EQ(mistyped.code, 2);
  EXPECT_HAS(mistyped.text, "did you mean run?");
  EXPECT_HAS(run("list two_balls_spring").text, "--set k=10000              N/m");
  EXPECT_HAS(run("list fesd").text, "elements=fixed|as_needed");
  EXPECT_HAS(run("list zeno").text, "zeno.json");
  EXPECT_EQ(run("list two_ball_spring").code, 2);
  EXPECT_HAS(run("list two_ball_spring").text, "or two_balls_spring");
  EXPECT_EQ(run("list two_balls_spring > /dev/full").code, 1) << "what was not printed was not said";
}

TEST_F(Cli, RunsAProblem) {
  const Outcome outcome = run("run --problem two_balls_spring --method fesd:gauss:4 --steps 200");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "status     success");
  EXPECT_HAS(outcome.text, "impact   t = 0.40385502187692");
  EXPECT_EQ(run("run --problem two_balls_spring --method cvode:adams --tolerance 1e-10").code, 0);
  EXPECT_EQ(run("run --problem sliding_block --method moreau_jean --step-length 0.01").code, 0);
}

TEST_F(Cli, RunsSceneFiles) {
  EXPECT_EQ(run("run --scene " + test_data("double_pendulum_wall.json") + " --method fesd:gauss:2 --steps 100").code,
            0);
  EXPECT_EQ(run("run --scene '" + reference_data("ground_truth.json") +
                "#P8b_spring_table' --method fesd:radau-iia:3 --steps 100")
                .code,
            0);
  EXPECT_EQ(run("run --scene '" + reference_data("ground_truth.json") +
                "#P6a_oblique_slip' --method anitescu_potra --steps 100 --set mu=0.1")
                .code,
            0);
}

TEST_F(Cli, ExportsAProblemAsASceneFile) {
  const std::string file = (folder / "block.json").string();
  const Outcome outcome = run("export --problem rocking_block --set mu=0.5 -o " + file);
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "scene file: " + file);
  EXPECT_HAS(read(file), "\"mu\": \"0.5\"");
  EXPECT_EQ(run("run --scene " + file + " --method moreau_jean --steps 100 --set phi0=0.1").code, 0);
  EXPECT_EQ(run("run --problem P6a_oblique_slip --method moreau_jean --steps 100").code, 0);
}

TEST_F(Cli, PrintsSensitivities) {
  const Outcome own = run("run -p P1a_ball_e09 -m fesd:gauss:2 -N 50 --sensitivity param:e --sensitivity q0:0");
  EXPECT_EQ(own.code, 0) << own.text;
  EXPECT_HAS(own.text, "d/d param:e\n  dq       ");
  EXPECT_HAS(own.text, "d/d q0:0\n  dq       ");
  const Outcome differences = run("run -p P1a_ball_e09 -m moreau_jean -N 50 --sensitivity param:e");
  EXPECT_EQ(differences.code, 0) << differences.text;
  EXPECT_HAS(differences.text, "d/d param:e, by differences of its solution\n  dq       ");
  EXPECT_HAS(differences.text, "for 5 solutions");
  EXPECT_EQ(run("run -p P1a_ball_e09 -m fesd:gauss:2 -N 50").text.find("d/d"), std::string::npos);
}

/// Between the steps, up to the end, with both limits at impacts.
TEST_F(Cli, DrawsAndWritesTheMotion) {
  const std::string csv = (folder / "deep" / "motion.csv").string(), plot = (folder / "plot").string();
  for (const char* method :
       {"fesd_adaptive:radau-iia:3 --tolerance 1e-6", "cvode:adams --tolerance 1e-8", "moreau_jean --steps 100"}) {
    const Outcome outcome = run(std::string("run -p bouncing_ball --points 10 --csv ") + csv + " -m " + method);
    ASSERT_EQ(outcome.code, 0) << outcome.text;
    const std::string text = read(csv);
    EXPECT_EQ(text.substr(0, 12), "t,q[0],v[0]\n");
    EXPECT_EQ(std::ranges::count(text, '\n'), 1 + 11 + 2 * 3) << "eleven times and three impacts";
    EXPECT_HAS(text, "\n2,");
  }
  ASSERT_EQ(run("run -p bouncing_ball -m fesd:gauss:2 -N 40 --plot " + plot).code, 0);
  EXPECT_HAS(read(folder / "plot" / "trajectory.svg"), "bouncing_ball, fesd:gauss:2, 40 steps");
  EXPECT_HAS(read(folder / "plot" / "trajectory.gp"), "title 'q[0]'");

  EXPECT_EQ(run("run -p bouncing_ball -m moreau_jean -N 10 --csv " + folder.string()).code, 2) << "a folder";

  const std::string svg = (folder / "ball.svg").string();
  ASSERT_EQ(run("run -p bouncing_ball -m fesd:gauss:2 -N 40 --animate " + svg).code, 0);
  EXPECT_HAS(read(svg), "<animate attributeName=\"cy\"");
  const Outcome without = run(std::string("run --scene ") + RICOCHET_TEST_DATA "/moving_table.json" +
                              " -m moreau_jean -N 10 --animate " + svg);
  EXPECT_EQ(without.code, 2);
  EXPECT_HAS(without.text, "states no geometry");
  EXPECT_EQ(run("run -p bouncing_ball -m moreau_jean -N 10 --points 5").code, 2) << "of which file?";
  // A full disk: nothing is left behind, and what was there stays.
  EXPECT_EQ(run("run -p bouncing_ball -m moreau_jean -N 10 --csv /dev/full").code, 2);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  const Outcome through = run("run -p bouncing_ball -m moreau_jean -N 10 --points 2 --csv /dev/stdout | cat");
  EXPECT_HAS(through.text, "t,q[0],v[0]\n0,1,");
}

TEST_F(Cli, PrintsTheMatrixOfHardCases) {
  const std::string where = " -o " + (folder / "results").string() + " --page " + (folder / "page").string();
  const std::string command = "run-experiment hard_cases --set only_case=wedge --set only_method=fesd:gauss:3";
  const Outcome outcome = run(command + where);
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "fesd:gauss:3  exact");
  const std::string page = read(folder / "page" / "experiments" / "hard_cases_part.html");
  EXPECT_HAS(page, "data-chart=\"verdicts\"");
  EXPECT_HAS(page, "ricochet run --problem disc_in_chute");
  const auto written = fs::last_write_time(folder / "results" / "hard_cases_part.jsonl");
  EXPECT_EQ(run(command + where).code, 0);
  EXPECT_EQ(fs::last_write_time(folder / "results" / "hard_cases_part.jsonl"), written)
      << "nothing is missing: nothing runs";
}

TEST_F(Cli, AFailedRunIsExitCodeOne) {
  const Outcome outcome = run("run --problem two_balls_spring --method fesd:gauss:1 --steps 80");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_HAS(
      outcome.text,
      "infeasible: step 34 of 80, from t = 0.4125 s: no solution with N_FE = 2: contact 'ground' would penetrate");
}

TEST_F(Cli, AMeasuredStateMayPenetrate) {
  const std::string ball = " -p bouncing_ball --set height=0.099999 -m moreau_jean -N 10";
  EXPECT_EQ(run("run" + ball).code, 2);
  for (const char* command : {"run", "audit"}) {
    const Outcome outcome = run(command + ball + " --allow-penetration 1e-5");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    EXPECT_NE(outcome.text.find("note       the initial state was changed, 'ground' had a gap of -1e-06 m: q0[0] by"),
              std::string::npos)
        << outcome.text;
  }
}

TEST_F(Cli, APenetrationMayStayForTheMethodToSolve) {
  const std::string ball = "run -p bouncing_ball --set e=0 --set height=0.09 -m moreau_jean -N 10 --keep-penetration ";
  EXPECT_EQ(run(ball + "0.001").code, 2) << "it is deeper";
  const Outcome outcome = run(ball + "0.011");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "no motion that obeys the laws begins in penetration");
  EXPECT_EQ(run(ball + "0.011 --allow-penetration 0.011").code, 2);
}

TEST_F(Cli, BadInputIsExitCodeTwoWithFieldValueAndWhatIsAllowed) {
  const std::pair<const char*, const char*> cases[] = {
      {"run -p bouncing_bal -m fesd:gauss:2 -N 10", "problem = 'bouncing_bal': unknown; did you mean bouncing_ball?"},
      {"run -p bouncing_ball -m fsd:gauss:2 -N 10", "method = 'fsd': unknown; did you mean"},
      {"run -p bouncing_ball -m fesd:gauss:12 -N 10", "stages of gauss = 12: 1 to 9 stages are possible"},
      {"run -p bouncing_ball -m fesd:gauss:2", "--steps is required for fixed-step methods"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 0", "steps = 0: at least one step is required"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N -3", "steps = -3: at least one step is required"},
      {"run -p bouncing_ball -m fesd:gauss:2 --step-length -0.1",
       "--step-length = -0.1: a positive number that divides T = 2 is required"},
      {"run -p bouncing_ball -m fesd:gauss:2 --step-length nan", "--step-length = nan"},
      {"run -p bouncing_ball -m cvode:adams --tolerance nan", "tolerance = nan: a number from 1e-15 to 1 is required"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set e=1.1",
       "contacts[0].e (ground) = 1.1: eps_r in [0, 1] is required"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set e=", "--set = e=: the value must be a number"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set e=1/m",
       "--set = e=1/m: the value must be a number or a formula of numbers, such as 1/2"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set e=3/2", "contacts[0].e (ground) = 1.5: eps_r in [0, 1]"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set height=0",
       "gap(q0) >= 0 is required, the scene starts in penetration; --allow-penetration DEPTH"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set height=0 --allow-penetration 0.01",
       "gap(q0) >= -0.01 is required"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --allow-penetration -1", "--allow-penetration"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set m=0",
       "a positive definite, non-singular mass matrix is required"},
      {"run -p sliding_block -m moreau_jean -N 10 --set mu=-1", "mu >= 0 is required"},
      {"run -p sliding_block -m irk:gauss:2 -N 10", "method irk:gauss:2 cannot run problem sliding_block"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --sensitivity param:gravity",
       "sensitivity = 'param:gravity': unknown; did you mean param:duration? Known: q0:0, v0:0, param:m, param:g,"},
      {"run -p bouncing_ball -m moreau_jean -N 10 --sensitivity q0:1",
       "sensitivity = 'q0:1': unknown; did you mean q0:0"},
      {"run -p sliding_block -m moreau_jean -N 10 --sensitivity q0:1",
       "sensitivity q0:1 by differences: contacts[0].gap (plane)"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --tolerance 1e-6",
       "--tolerance: fesd:gauss:2 takes fixed steps and no tolerance"},
      {"run -p bouncing_ball -m cvode:adams -N 10",
       "--steps: cvode:adams controls its error, it takes a tolerance and no steps"},
      {"audit -p bouncing_ball -m event_driven --step-length 0.1", "--step-length: event_driven"},
      {"run -p bouncing_ball -m fesd:gauss:2,n_fe=1,n_fe=2 -N 10", "method option = 'n_fe=2': n_fe is given twice"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 -N 20", "--steps"},
      {"run -p bouncing_ball -m fesd:gauss:2 -N 10 --set e=0.1 --set e=0.2",
       "--set = e=0.2: this parameter is given twice"},
      {"run --scene / -m fesd:gauss:2 -N 10", "scene file = /: it is a directory, a file is required"},
      {"run -p bouncing_ball -m fesd:@/ -N 10", "tableau file = /: it is a directory, a file is required"},
      {"show /", "results file = /: it is a directory, a file is required"},
      {"run-experiment homotopy_grid --set steps=[0]", "steps[0] = 0: a whole number >= 1 is required"},
      {"run -m fesd:gauss:2 -N 10", "--problem = '': a scene id, or --scene with a file, is required"},
      {"run --scene /nonexistent.json -m fesd:gauss:2 -N 10", "scene file = /nonexistent.json: cannot be opened"},
      {"run -p bouncing_ball -m fesd:@/nonexistent.json -N 10", "tableau file = /nonexistent.json: cannot be opened"},
      {"export --problem rocking_blok -o x.json", "problem = 'rocking_blok': unknown; did you mean rocking_block or"},
      {"export --problem rocking_block -o /nonexistent/x.json", "scene file = /nonexistent/x.json: cannot be written"},
      {"export --problem rocking_block -o /dev/null",
       "scene file = /dev/null: the file exists; a new file is required"},
      {"run-experiment no_such_experiment", "experiment = 'no_such_experiment': unknown"},
      {"run-experiment zeno --set restitution=[1.5]", "restitution[0] = 1.5: a number > 0 and < 1 is required"},
      {"run-experiment zeno --set restitution", "--set = restitution: FIELD=VALUE is required"},
      {"run-experiment pinning_order --set times=false", "an experiment without parts is required"},
      {"control two_carts --discretisation euler", "euler"},
      {"control two_carts --linear-solver ma57", "--linear-solver = ma57: one of mumps, ldl is required"},
      {"control two_carts --starts 2 --explore 3", "--starts = 2: no value is allowed with --method homotopy"},
      {"control two_carts --method shooting --explore 3 --knots 1",
       "knots = 1: a number from 2 to the number of control intervals, 10, is required"},
      {"control two_carts --method shooting --explore 3 --starts 0", "starts = 0: a number >= 1 is required"},
      {"control two_carts --method shooting --from-relaxation 0",
       "--from-relaxation = 0: a number > 0 and <= --sigma-0 = 1 is required"},
      {"control two_carts --method shooting --sigma-0 0.01",
       "--sigma-0 = 0.01: no value is allowed with --method shooting"},
      {"control two_carts --method shooting --discretisation time_stepping",
       "--discretisation = time_stepping: fesd is required, the only one of --method shooting"},
      {"control turbo_car --method shooting", "--method = shooting: a plant without formulas that bend or jump"},
      {"control nowhere.json --method shooting", "control problem = nowhere.json: cannot be opened"},
      {"mpc two_carts --updates 10", "--updates = 10: a number from 1 to 9 is required"},
      {"mpc two_carts --update-limit -1", "--update-limit = -1: a finite number >= 0 is required"},
      {"mpc two_carts --method shooting --update-limit nan", "--update-limit = nan: a finite number >= 0 is required"},
      {"mpc two_carts --method shooting --sigma-warm 0.1",
       "--sigma-warm = 0.1: no value is allowed with --method shooting"},
      {"mpc two_carts --disturbance -1", "--disturbance = -1: a finite number >= 0 is required"},
      {"report", "results = '': results files are required"},
      {"run-experiment hard_cases --set only_case=zen", "hard case = 'zen': unknown; did you mean zeno"},
      {"run-experiment hard_cases --set only_method=moreau", "method = 'moreau': unknown; did you mean moreau_jean"},
      {"show /nonexistent.jsonl", "results file = /nonexistent.jsonl: cannot be opened"},
      {"results /nonexistent.jsonl", "results file = /nonexistent.jsonl: cannot be opened"},
      {"report /nonexistent.jsonl", "results file = /nonexistent.jsonl: cannot be opened"},
      {"check /nonexistent.jsonl --baseline x", "results file = /nonexistent.jsonl: cannot be opened"},
  };
  for (const auto& [arguments, message] : cases) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << "\n" << outcome.text;
    EXPECT_HAS(outcome.text, message);
  }
}

TEST_F(Cli, SceneFileErrorsShowTheColumn) {
  const std::string scene =
      write("scene.json",
            R"({"params": {"m": "1"}, "q0": ["1"], "v0": ["0"], "T": "1", "M": [["m"]], "f": ["-m*9.81+q[3]"]})");
  const Outcome outcome = run("run --scene " + scene + " -m fesd:gauss:2 -N 10");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_HAS(outcome.text,
             "scene.json: f[0], column 9: index out of range, q has 1 entries\n  -m*9.81+q[3]\n          ^");
}

TEST_F(Cli, AuditsEveryCondition) {
  const Outcome outcome = run("audit two_balls_spring fesd:radau-iia:3 --steps 100");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  for (const char* condition :
       {"stage position", "stage velocity", "end velocity", "impulse balance", "impulse restitution",
        "closed separation", "cross complementarity", "step equilibration", "pinned breaking", "step length"}) {
    EXPECT_HAS(outcome.text, condition);
  }
  EXPECT_EQ(run("audit pendulum_wall moreau_jean").code, 0);
  EXPECT_EQ(run("audit --scene " + test_data("press.json") + " moreau_jean --steps 20").code, 0);
  EXPECT_EQ(run("audit -p pendulum_wall -m moreau_jean").code, 0);
  // Two bullets meet inside the fourth step, in which each goes 14 m.
  EXPECT_HAS(
      run("audit --scene " + reference_data("public_reports/scenes/bullets.json") + " moreau_jean --steps 7").text,
      "passed over within a step: contact 'bullets' [m]");
  EXPECT_HAS(run("audit pendulum_wall moreau_jean -p sliding_block").text,
             "problem_id = pendulum_wall: the problem is also given");
  EXPECT_HAS(run("audit").text, "--method = '': a method is required");
  EXPECT_EQ(run("audit moreau_jean").code, 2);
}

TEST_F(Cli, RunsAnExperimentResumesItAndChecksIt) {
  const std::string experiment = write("small.json", kExperiment), out = (folder / "results").string();
  const Outcome first = run("run-experiment " + experiment + " --no-times -o " + out);
  ASSERT_EQ(first.code, 0) << first.text;
  EXPECT_HAS(first.text, "Observed orders");
  EXPECT_HAS(first.text, "fesd:gauss:1,elements=as_needed: error");
  EXPECT_HAS(first.text, "ricochet run --problem two_balls_spring --method fesd:gauss:1 --steps 80");
  const std::string results = out + "/small.jsonl", complete = read(results);

  // The same again: nothing is run.
  ASSERT_EQ(run("run-experiment " + experiment + " --no-times -o " + out).code, 0);
  EXPECT_EQ(read(results), complete);

  // Interrupted after the fourth row, inside the fifth: continued without repeating or losing a row.
  std::istringstream lines(complete);
  std::string partial, line;
  for (int k = 0; k < 5 && std::getline(lines, line); ++k) partial += line + "\n";
  fs::remove(results);
  write("results/small.jsonl.partial", partial + R"({"kind": "row", "metho)");
  ASSERT_EQ(run("run-experiment " + experiment + " --no-times -o " + out).code, 0);
  EXPECT_EQ(undated(read(results)), undated(complete))
      << "rows are equal to the last bit, also those computed in another process";
  EXPECT_FALSE(fs::exists(results + ".partial"));
}

/// Results of the small experiment, and a baseline made of them.
class CheckCommand : public Cli {
 protected:
  std::string results = (folder / "out" / "small.jsonl").string(), baseline = (folder / "small.jsonl").string();

  void SetUp() override {
    Cli::SetUp();
    const std::string experiment = write("small.json", kExperiment);
    ASSERT_EQ(run("run-experiment " + experiment + " --no-times -o " + (folder / "out").string()).code, 0);
    ASSERT_EQ(run("check " + results + " --write " + baseline).code, 0);
  }
  Outcome check(const std::string& results_path, const std::string& baseline_path, const std::string& options = "") {
    return run("check " + results_path + " --baseline " + baseline_path + " " + options);
  }
  /// The results with every row changed.
  std::string changed(const std::function<void(nlohmann::json&)>& change) {
    std::string text;
    for (const auto& line : lines_of(read(results))) {
      nlohmann::json row = nlohmann::json::parse(line);
      if (row["kind"] == "row") change(row);
      text += row.dump() + "\n";
    }
    return write("changed.jsonl", text);
  }
};

TEST_F(CheckCommand, HoldsOrNamesWhatDoesNot) {
  const Outcome holds = check(results, baseline);
  EXPECT_EQ(holds.code, 0) << holds.text;
  EXPECT_HAS(holds.text, "0 regressions, 0 not compared, 0 improvements");
  EXPECT_EQ(run("check " + results + " --baselines " + folder.string()).code, 0);
  EXPECT_EQ(check(results, results).code, 0) << "any results are a baseline";

  const auto of_one_run = [](const nlohmann::json& row) {
    return row["method"] == "fesd:gauss:3" && row["steps"] == 120;
  };
  const Outcome worse = check(changed([&](auto& row) {
                                if (of_one_run(row)) row["error"] = 2 * row["error"].template get<double>();
                              }),
                              baseline);
  EXPECT_EQ(worse.code, 1) << worse.text;
  EXPECT_HAS(worse.text, "regression:   fesd:gauss:3 at 120: error");
  const Outcome more_work = check(changed([](auto& row) { row["counters"]["linear_solves"] = 1000000; }), baseline);
  EXPECT_EQ(more_work.code, 1);
  EXPECT_HAS(more_work.text, "linear solves");
  const Outcome residual = check(changed([&](auto& row) {
                                   if (of_one_run(row)) row["max_residual"] = 1e-6;
                                 }),
                                 baseline);
  EXPECT_EQ(residual.code, 1);
  EXPECT_HAS(residual.text, "regression:   fesd:gauss:3, residual:");
  const Outcome better = check(changed([](auto& row) {
                                 if (row["error"].is_number()) row["error"] = row["error"].template get<double>() / 10;
                               }),
                               baseline);
  EXPECT_EQ(better.code, 0) << better.text;
  EXPECT_HAS(better.text, "better:       fesd:gauss:3 at 60");
}

TEST_F(CheckCommand, NothingPassesThatWasNotCompared) {
  const auto refused = [&](const Outcome& outcome, const std::string& message) {
    EXPECT_EQ(outcome.code, 1) << outcome.text;
    EXPECT_HAS(outcome.text, message);
  };
  refused(check(changed([](auto& row) { row["error"] = nullptr; }), baseline),
          "not compared: fesd:gauss:3 at 60: success without an error");
  refused(check(changed([](auto& row) { row["error"] = -1; }), baseline), "error -1: a number >= 0 is required");
  refused(check(changed([](auto& row) { row["method"] = "another"; }), baseline),
          "not compared: fesd:gauss:3, all runs: the results do not have this method; its runs in the baseline: 8");
  const auto lines = lines_of(read(baseline));
  const std::string empty = write("empty.jsonl", lines.front() + "\n" + lines.back() + "\n");
  refused(check(results, empty), "not compared: small, all runs: the baseline holds no run");
  std::string without_first;
  for (std::size_t k = 0; k < lines.size(); ++k) without_first += k == 1 ? "" : lines[k] + "\n";
  refused(check(results, write("less.jsonl", without_first)),
          "not compared: fesd:gauss:1 at 80: this run is not in the baseline");
}

TEST_F(CheckCommand, WhatCannotBeReadIsExitCodeTwo) {
  const auto refused = [&](const std::string& arguments, const std::string& message) {
    const Outcome outcome = run("check " + arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << "\n" << outcome.text;
    EXPECT_HAS(outcome.text, message);
  };
  const std::string with = results + " --baseline ";
  refused(results, "--baseline");
  refused(with + "/nonexistent.jsonl", "baseline: results file = /nonexistent.jsonl: cannot be opened");
  refused(with + folder.string(), "it is a directory");
  refused(results + " --baselines /nonexistent", "/nonexistent/small.jsonl: cannot be opened");
  refused(folder.string() + " --baseline " + baseline, "it is a directory");
  refused(with + write("nothing.jsonl", ""), "nothing.jsonl: it has no header line");
  refused(with + write("text.jsonl", "no JSON\n"), "text.jsonl:1: not a line of a results file");
  refused(with + write("list.jsonl", "[]\n"), "list.jsonl:1: not a line of a results file");
  std::string damaged = read(baseline);
  damaged.replace(damaged.find("\"error\":"), 8, "\"eror\":");
  refused(with + write("damaged.jsonl", damaged), "damaged.jsonl:2: error = (missing): a number or null is required");
  const std::string cut = read(baseline).substr(0, damaged.size() / 2);
  refused(with + write("cut.jsonl", cut.substr(0, cut.rfind('\n') + 1)), "cut.jsonl: it is not complete");
  std::string other = read(baseline);
  other.replace(other.find("\"small\""), 7, "\"other\"");
  refused(with + write("other.jsonl", other), "other.jsonl:1: experiment = other: the results belong to small");
  refused(results + " " + results + " --baselines " + folder.string(), "another file also contains small");
  refused(results + " " + results + " --baseline " + baseline, "one results file is required");
  refused(with + baseline + " --write " + (folder / "x.jsonl").string(), "baseline");
  refused(with + baseline + " --json --github", "--json");
  for (const char* option : {" --json", " --github", " --junit x.xml", " --summary x.md"})
    refused(results + " --write " + (folder / "x.jsonl").string() + option, "--write");
  refused(with + baseline + " --junit /nonexistent/gate.xml", "/nonexistent/gate.xml: cannot be written");
  refused(with + baseline + " --junit " + baseline, "--junit = " + baseline + ": the file is also an input");
  refused(results + " --baselines " + folder.string() + " --summary " + baseline, ": the file is also an input");
  refused(results + " --replace " + baseline, "cannot be written");
  const std::string junit = write("gate.xml", "<testsuites/>");
  refused(with + "/nonexistent.jsonl --junit " + junit, "cannot be opened");
  EXPECT_FALSE(fs::exists(junit)) << "it says of an earlier check that it held";
  refused(results + " --write " + baseline, "the file exists");

  const std::string zeno = (folder / "zeno").string();
  ASSERT_EQ(run("run-experiment zeno --set restitution=[0.5] --quick -o " + zeno).code, 0);
  refused(zeno + "/zeno_part.jsonl --write " + (folder / "x.jsonl").string(),
          "study = zeno: results of a method_grid are required");
  EXPECT_FALSE(fs::exists(folder / "x.jsonl"));
}

TEST_F(CheckCommand, WritesForMachines) {
  const std::string worse = changed([](auto& row) {
    if (row["steps"] == 120) row["error"] = 1;
  });
  const std::string junit = (folder / "gate.xml").string(), summary = (folder / "gate.md").string();
  const Outcome outcome = check(worse, baseline, "--json --junit " + junit + " --summary " + summary);
  EXPECT_EQ(outcome.code, 1);
  const nlohmann::json json = nlohmann::json::parse(outcome.text);
  EXPECT_EQ(json["holds"], false);
  EXPECT_EQ(json["experiments"][0]["worse"], 1);
  EXPECT_HAS(read(junit),
             "<testcase classname=\"small\" name=\"fesd:gauss:3 at 120\" time=\"0\"><failure type=\"regression\"");
  EXPECT_HAS(read(summary), "### small: does not hold\n");
  EXPECT_EQ(check(results, baseline, "--junit " + junit).code, 0) << "it takes the place of the former one";
  EXPECT_EQ(read(junit).find("<failure"), std::string::npos);

  // A baseline that is put in place of another one holds what the results do.
  ASSERT_EQ(check(worse, baseline).code, 1);
  ASSERT_EQ(run("check " + worse + " --replace " + folder.string()).code, 0);
  EXPECT_EQ(check(worse, baseline).code, 0);
}

/// The steps of bench/gate/gate.yml, as GitHub runs them: the script of each in its own shell, which stops at a failure.
class GateWorkflow : public CheckCommand {
 protected:
  std::string summary = (folder / "summary.md").string();

  /// Text of `run:` of the step with this name, inline or as a block.
  static std::string script_of(const std::string& name) {
    std::string script;
    bool is_step = false, is_block = false;
    for (const auto& line : lines_of(read(test_data("../../bench/gate/gate.yml")))) {
      const auto indent = line.find_first_not_of(' ');
      if (indent == std::string::npos) continue;
      const std::string text = line.substr(indent);
      if (text.starts_with("- ")) is_step = text == "- name: " + name;
      if (indent <= 8) is_block = false;
      if (is_block) script += text + "\n";
      if (is_step && text == "run: |") is_block = true;
      if (is_step && text.starts_with("run: ") && text != "run: |") script = text.substr(5) + "\n";
    }
    return script;
  }
  Outcome step(const std::string& name) {
    const std::string script = write("step.sh", script_of(name));
    const std::string path = fs::path(RICOCHET_PROGRAM).parent_path().string();
    return run_command("cd " + folder.string() + " && PATH=" + path + ":$PATH GITHUB_STEP_SUMMARY=" + summary +
                       " sh -e " + script);
  }
};

TEST_F(GateWorkflow, Runs) {
  EXPECT_HAS(script_of("Build"), "ricochet/run build\n");
  EXPECT_HAS(read(test_data("../../run")), "\n  build)\n");
  fs::create_directories(folder / "experiments");
  fs::create_directories(folder / "baselines");
  fs::rename(folder / "small.json", folder / "experiments" / "small.json");
  fs::copy(baseline, folder / "baselines" / "small.jsonl");
  fs::remove_all(folder / "out");

  const Outcome made = step("Run");
  ASSERT_EQ(made.code, 0) << made.text;
  const Outcome holds = step("Hold");
  EXPECT_EQ(holds.code, 0) << holds.text;
  EXPECT_EQ(holds.text.find("::error"), std::string::npos);
  EXPECT_HAS(read(summary), "### small: holds\n");
  EXPECT_TRUE(fs::exists(folder / "out" / "gate.xml"));

  std::string better = read(folder / "baselines" / "small.jsonl");
  const auto at = better.find("\"error\":", better.find("\"steps\":90}"));
  better.insert(better.find_first_of(",}", at), "e-3");
  write("baselines/small.jsonl", better);
  const Outcome worse = step("Hold");
  EXPECT_EQ(worse.code, 1) << worse.text;
  EXPECT_HAS(worse.text, "::error file=baselines/small.jsonl,line=4,title=small%3A worse::fesd:gauss:1 at 90: error ");
  EXPECT_HAS(read(summary), "### small: holds\n");
  EXPECT_HAS(read(summary), "### small: does not hold\n");
  EXPECT_HAS(read(folder / "out" / "gate.xml"), "<failure");
}

TEST_F(Cli, TheQuickPartReplacesFieldsOfTheExperiment) {
  nlohmann::json experiment = nlohmann::json::parse(kExperiment);
  experiment["times"] = false;
  experiment["quick_part"] = {{"title", "The short one"}};
  const std::string file = write("small.json", experiment.dump()), out = (folder / "results").string();
  ASSERT_EQ(run("run-experiment " + file + " --quick -o " + out).code, 0);
  EXPECT_HAS(read(out + "/small.jsonl"), "The short one");
  ASSERT_EQ(run("run-experiment " + file + " --quick --set title=Mine -o " + out).code, 0);
  EXPECT_HAS(read(out + "/small_part.jsonl"), "Mine") << "the command line has the last word";
  ASSERT_EQ(run("run-experiment " + file + " -o " + out).code, 0);
  EXPECT_EQ(read(out + "/small.jsonl").find("The short one"), std::string::npos);
}

TEST_F(Cli, PrintsResultsForPapersAndPrograms) {
  const std::string experiment = write("small.json", kExperiment), out = (folder / "results").string();
  ASSERT_EQ(run("run-experiment " + experiment + " --quick -o " + out).code, 0);
  const std::string table = "table " + out + "/small.jsonl ";
  EXPECT_HAS(run(table + "--latex --view orders").text, "\\toprule\n    method & nominal &");
  const Outcome tidy = run(table + "--tidy -o " + out + "/tidy.csv");
  ASSERT_EQ(tidy.code, 0) << tidy.text;
  EXPECT_HAS(read(out + "/tidy.csv"), "counters_force_evaluations");
  EXPECT_HAS(read(out + "/tidy.csv"), "timing_median") << "the time of a run is in its line";
  EXPECT_HAS(run(table + "--pgfplots").text, "xmode=log");
  EXPECT_EQ(run(table).code, 2) << "no form";
  EXPECT_EQ(run(table + "--latex --tidy").code, 2) << "two of them";
  EXPECT_EQ(run(table + "--latex --view order").code, 2);
  EXPECT_HAS(run(table + "--latex --view orders --columns \"fitted slope,method\"").text,
             "\\toprule\n    fitted slope & method \\\\\n");
  const Outcome unknown = run(table + "--latex --view orders --columns method,speed");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_HAS(unknown.text, "column = 'speed': unknown. Known: method, nominal, ");
  EXPECT_EQ(run(table + "--tidy --columns method").code, 2) << "its columns are all";
  ASSERT_EQ(run(table + "--pgfplots --view work_precision -o " + out + "/fig.tex").code, 0);
  EXPECT_HAS(read(out + "/fig.tex"), "{fig.dat}");
  EXPECT_HAS(read(out + "/fig.dat"), "# columns 0 and 1: ");
}

/// LaTeX is no package that the project needs: where it is, what is made for it compiles, and figures and floats fit the page.
class Latex : public Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    if (std::system(
            "command -v pdflatex xz >/dev/null && kpsewhich pgfplots.sty standalone.cls booktabs.sty adjustbox.sty >/dev/null") !=
        0)
      GTEST_SKIP() << "pdflatex, pgfplots, standalone, booktabs, adjustbox, xz";
  }
  std::string archived(const std::string& id) {
    const std::string file = (folder / (id + ".jsonl")).string();
    run_command("xz -dc " + test_data("../../reports/published/archive/" + id + ".jsonl.xz") + " >" + file);
    return file;
  }
  /// @param name  of a document in the folder  @param fits  whether nothing may be wider than its line: a long table may
  void compile(const std::string& name, bool fits = true) {
    const std::string command = "cd " + folder.string() +
                                " && timeout 200 pdflatex -interaction=nonstopmode -halt-on-error " + name + ".tex >" +
                                name + ".out 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << read(folder / (name + ".out"));
    EXPECT_TRUE(fs::exists(folder / (name + ".pdf")));
    constexpr double kVisible = 2;  // [pt]
    const std::regex overfull(R"(Overfull \\hbox \(([0-9.]+)pt[^\n]*)");
    for (const auto& line : lines_of(read(folder / (name + ".log")))) {
      std::smatch found;
      EXPECT_EQ(line.find("Float too large"), std::string::npos) << line;
      if (fits && std::regex_search(line, found, overfull)) EXPECT_LE(std::stod(found[1]), kVisible) << found[0];
    }
  }
};

TEST_F(Latex, TakesTablesOfAllThatIsArchived) {
  std::string all;
  for (const auto& entry : fs::directory_iterator(test_data("../../reports/published/archive")))
    all += archived(entry.path().stem().stem().string()) + " ";
  const Outcome made = run("table " + all + "--latex -o " + (folder / "tables.tex").string());
  ASSERT_EQ(made.code, 0) << made.text;
  write("document.tex",
        "\\documentclass{article}\\usepackage[utf8]{inputenc}\\usepackage[T1]{fontenc}\\usepackage{lmodern}\n"
        "\\usepackage{booktabs,array,longtable,adjustbox}\\usepackage[a4paper,margin=2cm]{geometry}\n"
        "\\extrafloats{100}\\begin{document}\\input{tables}\\end{document}\n");
  compile("document", false);
}

TEST_F(Latex, TakesCharts) {
  for (const std::string id : {"two_balls_order", "scale", "contact_solvers", "zeno"}) {
    const std::string results = archived(id);
    const Outcome made = run("table " + results + " --pgfplots -o " + (folder / (id + ".tex")).string());
    ASSERT_EQ(made.code, 0) << made.text;
    compile(id);
  }
  write("inside.tex", run("table " + archived("two_balls_order") + " --pgfplots").text);
  compile("inside");
}

TEST_F(Cli, LooksAtTheHistoryBeforeItRuns) {
  const std::string experiment = write("small.json", kExperiment), out = (folder / "results").string();
  const Outcome outcome = run("run-experiment " + experiment + " --quick -o " + out + " --page " +
                              (folder / "page").string() + " --history " + (folder / "nothing").string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_HAS(outcome.text, "a folder of ./run history is required");
  EXPECT_FALSE(fs::exists(fs::path(out) / "small.jsonl"));
}

TEST_F(Cli, WritesAReport) {
  const std::string experiment = write("small.json", kExperiment), out = (folder / "results").string(),
                    report = (folder / "report").string();
  ASSERT_EQ(run("run-experiment " + experiment + " --quick -o " + out).code, 0);
  const Outcome outcome = run("report " + out + "/small.jsonl --pdf -o " + report);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_TRUE(read(report + "/experiments/small_trajectory.pdf").starts_with("%PDF"));
  EXPECT_HAS(read(report + "/experiments/small_trajectory.gp"), "set terminal svg")
      << "the script of the figure on the page";
  const std::string page = read(report + "/experiments/small.html");
  EXPECT_HAS(page, "small_trajectory.svg");
  EXPECT_HAS(page, "Observed orders");
  EXPECT_HAS(page, "Time to reach an error");
  EXPECT_HAS(page, "Quick run");
  EXPECT_EQ(page.find("not complete"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos) << "the page needs no server";
  EXPECT_HAS(page, "data-chart=\"work_precision\"");
  EXPECT_HAS(page, "fesd:gauss:3");
  EXPECT_HAS(read(report + "/index.html"), "experiments/small.html");
  for (const char* file : {"small_order_fesd_gauss.svg", "small_work_precision.svg", "small_trajectory.svg",
                           "small_orders.csv", "small_runs.csv", "small.jsonl"}) {
    EXPECT_TRUE(fs::exists(fs::path(report) / "experiments" / file)) << file;
  }
  const std::string rows = read(out + "/small.jsonl");
  const std::string cut = write("cut.jsonl", rows.substr(0, rows.rfind("{\"kind\":\"end\"")));
  ASSERT_EQ(run("report " + cut + " -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/small.html"), "not complete");
}

TEST_F(Cli, ComparesOptimalControlWithThePlant) {
  const std::string experiment = write("carts.json", R"({"id": "carts", "kind": "optimal_control", "title": "Carts",
      "description": "", "runs": [{"problem": "two_carts", "fesd": "--simulate --sigma-0 0.01",
      "time_stepping": "--sigma-0 1e-3 --max-iterations 1", "shooting": "--explore 12"}],
      "goals": [{"problem": "two_carts", "quantity": "cost", "at_most": 1}]})");
  const std::string out = (folder / "results").string(), report = (folder / "report").string();
  const Outcome outcome = run("run-experiment " + experiment + " -o " + out);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "FESD-J radau-iia:3, 10 intervals of 2 elements");
  EXPECT_HAS(outcome.text, "time stepping, 10 intervals of 6 steps");
  EXPECT_HAS(outcome.text, "step_limit: relaxation");  // a run that is not solved is shown, with its reason
  EXPECT_HAS(outcome.text, "FESD-J radau-iia:3, 10 intervals of 2 elements or more");
  EXPECT_HAS(outcome.text, "Shooting against the homotopy");
  ASSERT_EQ(run("report " + out + "/carts.jsonl -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/carts.html"), "Claimed and true optimal control");
  EXPECT_HAS(read(report + "/experiments/carts_two_carts_scene.svg"), "<animate attributeName=\"points\"");
  for (const char* file : {"carts_two_carts.svg", "carts_two_carts_frames.svg", "carts_two_carts_shooting_scene.svg"})
    EXPECT_TRUE(fs::exists(fs::path(report) / "experiments" / file)) << file;
}

TEST_F(Cli, StudiesRandomGuessesAndGoesOnAfterAnInterruption) {
  const std::string experiment = write("guesses.json", R"({"id": "guesses", "kind": "control_seeds", "title": "Guesses",
      "description": "", "runs": [{"problem": "two_carts", "arguments": "--simulate --sigma-0 0.01 --noise 0.1",
      "seeds": 2, "time_limit": 60}]})");
  const std::string out = (folder / "results").string(), report = (folder / "report").string();
  const Outcome outcome = run("run-experiment " + experiment + " -o " + out);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "2 of 2, 100 %");
  const auto lines = lines_of(read(out + "/guesses.jsonl"));
  ASSERT_EQ(lines.size(), 4u) << "header, two runs, end";
  EXPECT_NE(nlohmann::json::parse(lines[1])["cost"], nlohmann::json::parse(lines[2])["cost"]) << "two guesses";

  // As if it had been stopped while it wrote the second run.
  fs::remove(out + "/guesses.jsonl");
  std::ofstream(out + "/guesses.jsonl.partial") << lines[0] << "\n" << lines[1] << "\n" << lines[2].substr(0, 50);
  ASSERT_EQ(run("run-experiment " + experiment + " -o " + out).code, 0);
  const auto continued = lines_of(read(out + "/guesses.jsonl"));
  ASSERT_EQ(continued.size(), 4u);
  EXPECT_EQ(continued[1], lines[1]) << "with its times: it was not run again";
  EXPECT_EQ(nlohmann::json::parse(continued[2])["cost"], nlohmann::json::parse(lines[2])["cost"]);

  ASSERT_EQ(run("report " + out + "/guesses.jsonl -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/guesses.html"), "Random initial guesses");
  for (const char* file : {"guesses.svg", "guesses_success.csv", "guesses_runs.csv"})
    EXPECT_TRUE(fs::exists(fs::path(report) / "experiments" / file)) << file;
}

TEST_F(Cli, AStudyWithAMistakeIsNotStarted) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"problem": "two_carts", "arguments": "", "seeds": 0, "time_limit": 9})",
       "runs[0].seeds = 0: a whole number >= 1 is required"},
      {R"({"problem": "two_carts", "arguments": "", "seeds": 1, "time_limit": -1})",
       "runs[0].time_limit = -1: a number > 0 is required"},
      {R"({"problem": "two_carts", "arguments": "--seed 3", "seeds": 1, "time_limit": 9})",
       "runs[0].arguments = --seed 3: no --seed"},
      {R"({"problem": "two_carts", "arguments": "--nose 3", "seeds": 1, "time_limit": 9})", "--nose"},
      {R"({"problem": "two_cats", "arguments": "", "seeds": 1, "time_limit": 9})", "did you mean two_carts"},
      {R"({"problem": "two_carts", "argument": "", "seeds": 1, "time_limit": 9})", "did you mean arguments"},
      {R"({"problem": "two_carts", "arguments": "", "time_limit": 9})", "x.json: runs[0].seeds: this field is missing"},
  };
  for (const auto& [text, message] : cases) {
    const std::string experiment = write("x.json", std::string(R"({"id": "x", "kind": "control_seeds", "title": "X",
        "description": "", "runs": [)") + text + "]}");
    const Outcome outcome = run("run-experiment " + experiment + " -o " + folder.string());
    EXPECT_EQ(outcome.code, 2) << text << outcome.text;
    EXPECT_HAS(outcome.text, message);
    EXPECT_FALSE(fs::exists(folder / "x.jsonl"));
  }
}

TEST_F(Cli, PlansAgainWhileThePlantRuns) {
  const Outcome outcome = run("mpc two_carts --simulate --sigma-0 0.01 --updates 2 --disturbance 0.005");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "0 are not solved");
  const std::string shooting = "mpc two_carts --method shooting --explore 12 --disturbance 0.03";
  const Outcome shot = run(shooting);
  ASSERT_EQ(shot.code, 0) << shot.text;
  EXPECT_HAS(shot.text, "0 have no plan");
  const Outcome late = run(shooting + " --update-limit 1e-9");
  EXPECT_EQ(late.code, 0) << "the limit of an update is no failure: " << late.text;
  EXPECT_HAS(late.text, "time_limit: the time limit of 1e-09 s was reached");
  EXPECT_HAS(late.text, "0 of 9 are stationary, 0 have no plan");
}

TEST_F(Cli, MeasuresTheGrowthOfTheWork) {
  const std::string experiment = write("growth.json", R"({"id": "growth", "kind": "control_growth", "title": "Growth",
      "description": "", "disturbance": 0.001, "runs": [{"problem": "two_carts", "intervals": [4, 6, 8],
      "arguments": "--simulate --sigma-0 0.01 --max-branches 0"}]})");
  const std::string out = (folder / "results").string(), report = (folder / "report").string();
  const Outcome outcome = run("run-experiment " + experiment + " --all -o " + out);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "3 solved");
  EXPECT_HAS(outcome.text, "Steps of the homotopies");
  ASSERT_EQ(run("report " + out + "/growth.jsonl -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/growth.html"), "Growth of the work");
}

TEST_F(Cli, MeasuresStepsOfGrowingScenesAndGoesOnAfterAnInterruption) {
  const std::string text = R"({"id": "rows", "kind": "scale", "title": "Rows", "description": "", "steps": 4,
      "time_limit": 20, "runs": [{"problem": "bead_row", "scene": "beads at rest", "set": {"distance": 0, "spacing": 0,
      "speed": 0}, "sizes": [2, 4, 8], "methods": ["moreau_jean,solver=newton", "irk:gauss:2"]}]})";
  const std::string experiment = write("rows.json", text);
  const std::string out = (folder / "results").string(), report = (folder / "report").string();
  const Outcome outcome = run("run-experiment " + experiment + " -o " + out);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "fit of 3");
  EXPECT_HAS(outcome.text, "it knows no contacts");
  EXPECT_HAS(outcome.text, "a smaller one did not end");
  const auto lines = lines_of(read(out + "/rows.jsonl"));
  ASSERT_EQ(lines.size(), 8u) << "header, three runs of each method, end";

  // As if it had been stopped while the second method ran.
  fs::remove(out + "/rows.jsonl");
  std::ofstream(out + "/rows.jsonl.partial") << lines[0] << "\n"
                                             << lines[1] << "\n"
                                             << lines[2] << "\n"
                                             << lines[3] << "\n";
  ASSERT_EQ(run("run-experiment " + experiment + " -o " + out).code, 0);
  const auto continued = lines_of(read(out + "/rows.jsonl"));
  ASSERT_EQ(continued.size(), 8u);
  for (int k = 1; k <= 3; ++k) EXPECT_EQ(continued[k], lines[k]) << "with its times: it was not run again";
  ASSERT_EQ(run("report " + out + "/rows.jsonl -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/rows.html"), "beads at rest");

  std::string mistake = text;
  mistake.replace(mistake.find("\"sizes\""), 7, "\"size\"");
  const Outcome refused = run("run-experiment " + write("mistake.json", mistake) + " -o " + out);
  EXPECT_EQ(refused.code, 2);
  EXPECT_HAS(refused.text, "did you mean sizes");
}

TEST_F(Cli, RunsAnEnsembleAndGoesOnAfterAnInterruption) {
  const std::string out = (folder / "spring.csv").string();
  const std::string command =
      "ensemble -p two_balls_spring --vary k=log-uniform:1e3:1e4 --vary e=values:0.7:0.8 --runs 5 -m event_driven "
      "--tolerance 1e-6 -o ";
  const Outcome outcome = run(command + out + " --threads 2");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "success    10");
  const std::string whole = read(out);
  EXPECT_EQ(lines_of(whole).size(), 11u);
  EXPECT_HAS(whole, "run,k,e,status,t,q[0],q[1],v[0],v[1],steps,events,message\n");
  fs::remove(out);
  std::ofstream(out + ".partial") << whole.substr(0, whole.size() / 2);
  const Outcome again = run(command + out + " --threads 1");
  EXPECT_EQ(again.code, 0) << again.text;
  EXPECT_HAS(again.text, "of 10 runs already exist");
  EXPECT_EQ(read(out), whole);

  const Outcome other = run(command + out + " --seed 2");
  EXPECT_EQ(other.code, 2);
  EXPECT_HAS(other.text, "the file contains another ensemble");
  const std::string file = write("study.json", R"({"problem": "two_balls_spring", "vary": ["e=grid:0.8:1.2:3"],
      "method": "moreau_jean", "steps": 100})");
  const Outcome failed = run("ensemble " + file + " -N 50 -o " + (folder / "grid.csv").string());
  EXPECT_EQ(failed.code, 1) << failed.text;
  EXPECT_HAS(failed.text, "bad_input  1");
  EXPECT_EQ(run("ensemble " + file + " --vary e=flat:0:1 -o " + (folder / "bad.csv").string()).code, 2);
  EXPECT_EQ(run("ensemble " + file + " --set speed=1 -o " + (folder / "bad.csv").string()).code, 2);
  EXPECT_FALSE(fs::exists(folder / "bad.csv.partial"));
}

TEST_F(Cli, StudiesHowABallComesToRest) {
  const std::string experiment = write("zeno.json", R"({"id": "zeno", "kind": "zeno", "title": "Rest",
      "description": "", "tableaus": ["radau-iia:2", "gauss:2"], "restitution": [0.5], "step_lengths": {"from": 0.1,
      "to": 0.01, "per_decade": 3}, "methods": ["fesd:radau-iia:2", "fesd:gauss:2"], "tolerances": [1e-3],
      "adaptive_methods": ["fesd_adaptive:radau-iia:3"]})");
  const std::string out = (folder / "results").string(), report = (folder / "report").string();
  const Outcome outcome = run("run-experiment " + experiment + " -o " + out);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "A ball comes to rest");
  EXPECT_HAS(outcome.text, "2.000000");  // kappa of Radau IIA, 2 stages
  ASSERT_EQ(run("report " + out + "/zeno.jsonl -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/zeno.html"), "Closed elements that start with v+");
  EXPECT_EQ(run("run-experiment " + write("bad.json", R"({"id": "bad", "kind": "zeno", "title": "", "description": "",
      "tableaus": [], "restitution": [1.5], "step_lengths": {"from": 0.1, "to": 0.01, "per_decade": 3},
      "methods": []})") +
                " -o " + out)
                .code,
            2);
}

TEST_F(Cli, StudiesTheStickBoundaryOfARamp) {
  const std::string experiment = write("ramp.json", R"({"id": "ramp", "kind": "friction_ramp", "title": "Ramp",
      "description": "", "grid": 5, "duration": 0.5, "v_0": [-1], "methods": [{"method": "fesd:radau-iia:3",
      "steps": 5}, {"method": "moreau_jean", "steps": 20, "stride": 2}, {"method": "irk:gauss:2", "steps": 5}],
      "facets": {"directions": 3, "load": 1.1, "methods": [{"method": "moreau_jean,facets=4", "facets": 4,
      "steps": 5}]}})");
  const std::string out = (folder / "results").string(), report = (folder / "report").string();
  const Outcome outcome = run("run-experiment " + experiment + " -o " + out);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "does it stick?");
  EXPECT_HAS(outcome.text, "declined: it knows no contacts");
  EXPECT_HAS(outcome.text, "0.7071");
  ASSERT_EQ(run("report " + out + "/ramp.jsonl -o " + report).code, 0);
  EXPECT_HAS(read(report + "/experiments/ramp.html"), "A polygon in place of the friction disc");
}

TEST_F(Cli, AnUnexpectedFailureOfARowIsExitCodeOne) {
  const auto code_of = [&](const std::string& fields) {
    const std::string text = R"({"id": "small", "problem": "two_balls_spring", "reference": null, "times": false,
        "methods": [{"method": "fesd:gauss:1", "steps": [80])" +
                             fields + "}]}";
    return run("run-experiment " + write("small.json", text) + " -o " + folder.string()).code;
  };
  EXPECT_EQ(code_of(""), 1);
  EXPECT_EQ(code_of(R"(, "may_fail": "one stage has too few unknowns")"), 0);
  EXPECT_EQ(code_of(R"(, "on_failure": "fesd:gauss:1,elements=as_needed")"), 0) << "another method answers it";
  EXPECT_EQ(code_of(R"(, "on_failure": "fesd:gauss:1,switches=published")"), 1) << "which fails, too";
}

TEST_F(Cli, VerifiesAMethod) {
  const std::string xml = (folder / "card.xml").string(), svg = (folder / "card.svg").string(),
                    summary = (folder / "card.md").string();
  const std::string quick = "verify --method fesd_adaptive:radau-iia:4 --quick ";
  const Outcome passed = run(quick + "--junit " + xml + " --badge " + svg + " --summary " + summary);
  EXPECT_EQ(passed.code, 0) << passed.text;
  EXPECT_HAS(passed.text, "fesd_adaptive:radau-iia:4: ");
  EXPECT_HAS(passed.text, " 0 failed");
  EXPECT_HAS(read(xml), "failures=\"0\"");
  EXPECT_HAS(read(svg), "<svg");
  EXPECT_HAS(read(summary), "✅");

  // Gauss tableaus have no stage at the right end, at which friction in space could come to rest.
  const std::string gauss =
      "verify --method fesd:gauss:4,elements=as_needed --check truth/P7a_slide3d_to_stick --quick ";
  const Outcome failed = run(gauss);
  EXPECT_EQ(failed.code, 1) << failed.text;
  EXPECT_HAS(failed.text, "ricochet run --problem P7a_slide3d_to_stick");
  const Outcome known = run(gauss + "--check truth/P1c_ball_e0 --known 'truth/P7a*' --known 'truth/P1c*' --json");
  EXPECT_EQ(known.code, 0) << known.text;
  const auto card = nlohmann::json::parse(known.text);
  EXPECT_EQ(card["known"], 1);
  EXPECT_EQ(card["mended"], nlohmann::json::array({"truth/P1c*"}));

  const Outcome list = run("verify --list");
  EXPECT_EQ(list.code, 0);
  EXPECT_HAS(list.text, "order/smooth motion\n");
  EXPECT_HAS(run(quick + "--check order/impact").text, "check = 'order/impact': unknown; did you mean order/impacts?");
  EXPECT_EQ(run(quick + "--check order/impact").code, 2);
  EXPECT_HAS(run("verify --quick").text, "--method = '': a method is required");
  EXPECT_EQ(run("verify --battery zeno --list").code, 2);
}

/// "nan" is neither below nor above a limit.
TEST_F(Cli, OptionsRefuseWhatIsNoNumber) {
  const std::string run_it = "run -p bouncing_ball -m fesd:gauss:2 -N 10 ",
                    study = "run-experiment zeno --print-experiment ";
  for (const std::string& line :
       {run_it + "--allow-penetration", run_it + "--keep-penetration", run_it + "--time-limit", study + "--time-limit",
        "fuzz --scenes 1 --time"s, "control two_carts --time-limit"s,
        "ensemble -p bouncing_ball --runs 1 -m fesd:gauss:2 -N 10 --time-limit"s}) {
    for (const char* value : {"nan", "-nan", "inf", "-1"}) {
      const Outcome outcome = run(line + " " + value);
      EXPECT_EQ(outcome.code, 2) << line << value << outcome.text;
      EXPECT_HAS(outcome.text, line.substr(line.rfind("--")));
    }
  }
}

TEST_F(Cli, ShowsViewsOfResults) {
  const std::string experiment = write("small.json", kExperiment), results = (folder / "small.jsonl").string();
  ASSERT_EQ(run("run-experiment " + experiment + " --quick -o " + folder.string()).code, 0);
  const Outcome all = run("show " + results);
  EXPECT_EQ(all.code, 0) << all.text;
  for (const char* part : {"Observed orders", "Time to reach an error", "Runs without a solution"})
    EXPECT_HAS(all.text, part);
  EXPECT_EQ(all.text.find("All runs"), std::string::npos);
  EXPECT_HAS(run("show " + results + " --all").text, "All runs");
  const Outcome runs = run("show " + results + " --view runs,times");
  EXPECT_HAS(runs.text, "All runs");
  EXPECT_HAS(runs.text, "Speed against error");
  EXPECT_EQ(runs.text.find("Observed orders"), std::string::npos);
  const Outcome unknown = run("show " + results + " --view order");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_HAS(unknown.text, "view of " + results + " = 'order': unknown; did you mean orders");

  const std::string page = (folder / "RESULTS.md").string();
  ASSERT_EQ(run("results " + results + " -o " + page + " --tables " + (folder / "tables").string()).code, 0);
  EXPECT_HAS(read(page), "| fesd:gauss:3 |");
  EXPECT_HAS(read(page), "[All runs](tables/small_runs.csv)");
  EXPECT_TRUE(fs::exists(folder / "tables" / "small_orders.csv"));
}

TEST_F(Cli, ComparesHomotopiesWithPivoting) {
  const std::string command =
      "run-experiment homotopy_grid --set steps=[50] --set stages=2 --set guess=[\"pivoting\"] "
      "--set families=[\"radau-iia\"] --set margin=0 -o " +
      folder.string();
  std::string quoted = command;
  for (std::size_t at = 0; (at = quoted.find('"', at)) != std::string::npos; at += 2) quoted.insert(at, "\\");
  const Outcome outcome = run(quoted);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "guess=pivoting");
  EXPECT_EQ(lines_of(read(folder / "homotopy_grid_part.jsonl")).size(), 6u) << "header, two of each solver, end";
}

TEST_F(Cli, AnExperimentWithAMistakeLeavesNoResults) {
  const std::string out = (folder / "results").string();
  const std::pair<const char*, const char*> cases[] = {
      {R"({"id": "x", "problem": "two_balls_spring", "methods": [{"method": "fesd:gauss:3", "steps": "nowhere"}]})",
       "nowhere"},
      {R"({"id": "x", "problem": "two_balls_spring", "methods": [{"method": "fesd:gauss:3", "steps": [0]}]})",
       "x.json: methods[0].steps[0] = 0: a whole number >= 1 is required"},
      {R"({"id": "x", "problem": "two_balls_spring", "methods": [{"method": "fesd:gauss:3"}]})",
       "\"steps\" of a fixed-step method or"},
      {R"({"id": "x", "problem": "two_balls", "methods": [{"method": "moreau_jean", "steps": [5]}]})",
       "problem = 'two_balls': unknown"},
      {R"({"id": "x", "problem": "two_balls_spring", "method": []})", "did you mean methods?"},
      {R"({"id": "x", "problem": "bouncing_ball", "sensitivities": ["param:e"],
           "methods": [{"method": "moreau_jean", "steps": [5]}]})",
       "sensitivities = [\"param:e\"]: a problem with a solution known to many digits is required"},
      {R"({"id": "x", "problem": "two_balls_spring", "sensitivities": ["param:R"],
           "methods": [{"method": "moreau_jean", "steps": [5]}]})",
       "sensitivity in the ground truth of P2_two_balls_spring = 'param:R': unknown"},
      {R"({"id": "x", "problem": "two_balls_spring", "methods": []})", "methods, number of entries = 0: at least 1"},
      {R"({"id": "x")", "x.json: not valid JSON"},
  };
  for (const auto& [text, message] : cases) {
    const Outcome outcome = run("run-experiment " + write("x.json", text) + " -o " + out);
    EXPECT_EQ(outcome.code, 2) << text << outcome.text;
    EXPECT_HAS(outcome.text, message);
    EXPECT_FALSE(fs::exists(out + "/x.jsonl"));
  }
}

TEST_F(Cli, SceneFilesGiveTheSameBitsInEveryProcess) {
  const std::string arguments =
      "run --scene '" + reference_data("ground_truth.json") + "#P2_two_balls_spring' --method fesd:gauss:4 --steps 300";
  const auto state = [&] {
    const std::string text = run(arguments).text;
    const auto begin = text.find("q          ");
    return text.substr(begin, text.find("energy") - begin);
  };
  const std::string first = state();
  for (int k = 0; k < 5; ++k) EXPECT_EQ(state(), first);
}

TEST_F(Cli, RecordsAndSolvesContactProblems) {
  const std::string set = (folder / "set").string();
  const Outcome recorded = run("contacts record " + set + " --steps 20 --per-scene 2");
  ASSERT_EQ(recorded.code, 0) << recorded.text;
  EXPECT_HAS(recorded.text, "contact problems in");
  EXPECT_TRUE(fs::exists(folder / "set/box_3d.jsonl"));
  const Outcome solved = run("contacts solve " + set + " --solver newton --solver admm --min-contacts 2");
  EXPECT_EQ(solved.code, 0) << solved.text;
  for (const char* part : {"Conditioning", "Performance profiles", "Internal forces", "newton", "admm", "box_3d"})
    EXPECT_HAS(solved.text, part);
  const std::string scene = (folder / "set/box_3d.jsonl").string();
  const Outcome one = run("contacts solve " + scene + " --solver newton --solver interior_point");
  EXPECT_EQ(one.code, 0) << one.text;
  for (const char* part : {"Residuals law by law", "FCLib's merit", "dissipation", "interior_point"})
    EXPECT_HAS(one.text, part);
  const Outcome lines = run("contacts solve " + scene + " --solver newton --json");
  const auto first = nlohmann::json::parse(lines.text.substr(0, lines.text.find('\n')));
  EXPECT_TRUE(first["solved"]);
  EXPECT_LE(first["violation"], 1e-9) << "the default tolerance";
  EXPECT_TRUE(first.contains("fclib_merit"));
  const Outcome none = run("contacts solve " + scene + " --min-contacts 100");
  EXPECT_EQ(none.code, 2);
  EXPECT_HAS(none.text, "no problem has that many contacts");
  EXPECT_EQ(run("contacts record " + set + " --method penalty").code, 2) << "it solves no contact problem";
  EXPECT_EQ(run("contacts solve " + (folder / "nothing").string()).code, 2);
  const Outcome merit = run("contacts merit --draws 2");
  EXPECT_EQ(merit.code, 0) << merit.text;
  EXPECT_HAS(merit.text, "over the true distance of velocities");
  const Outcome laws = run("contacts impact-laws");
  EXPECT_EQ(laws.code, 0) << laws.text;
  EXPECT_HAS(laws.text, "+58.7 %");  // Kane's pendulum under Newton's law, as in the text of the scene
  EXPECT_EQ(run("contacts impact-laws -e 2").code, 2);
}

TEST_F(Cli, ExchangesContactProblems) {
  const std::string file = (folder / "column.hdf5").string();
  const std::string scene = "contacts export --problem block_column --set n=8 --set duration=0.1 --steps 20 ";
  const Outcome exported = run(scene + "--method moreau_jean,solver=newton --step 3 -o " + file);
  if (exported.text.find("not built: libhdf5-dev not found") != std::string::npos) {
    EXPECT_EQ(exported.code, 2);
    EXPECT_EQ(run("contacts solve " + file).code, 2);
    return;
  }
  ASSERT_EQ(exported.code, 0) << exported.text;
  EXPECT_HAS(exported.text, "step 3 of 20");
  EXPECT_HAS(exported.text, "contacts with friction in the plane");
  const Outcome solved = run("contacts solve " + file + " --solver newton --solver lemke --solver interior_point");
  EXPECT_EQ(solved.code, 0) << solved.text;
  for (const char* part : {"newton", "lemke", "interior_point", "solved"}) EXPECT_HAS(solved.text, part);
  const Outcome limited = run("contacts solve " + file + " --solver pgs,contact_iterations=1");
  EXPECT_EQ(limited.code, 1) << limited.text;
  EXPECT_HAS(limited.text, "did not reach its tolerance");

  EXPECT_EQ(run(scene + "--method moreau_jean --step 3 -o " + file).code, 2) << "the file exists";
  const std::string other = (folder / "other.hdf5").string();
  const Outcome late = run(scene + "--method moreau_jean --step 21 -o " + other);
  EXPECT_EQ(late.code, 2);
  EXPECT_HAS(late.text, "--step = 21");
  EXPECT_EQ(run(scene + "--method penalty -o " + other).code, 2) << "it solves no contact problem";
  EXPECT_EQ(run(scene + "--method anitescu_convex -o " + other).code, 2) << "the associated law";
  EXPECT_FALSE(fs::exists(other));
  const Outcome missing = run("contacts solve " + other);
  EXPECT_EQ(missing.code, 2);
  EXPECT_HAS(missing.text, "does not exist");
  EXPECT_EQ(run("contacts solve " + write("text.hdf5", "text")).code, 2);
  const Outcome unknown = run("contacts solve " + file + " --solver simplex");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_HAS(unknown.text, "simplex");
  EXPECT_EQ(run("contacts solve " + file + " --solver newton,facets=8").code, 2);
}

}  // namespace
}  // namespace ricochet::cli
