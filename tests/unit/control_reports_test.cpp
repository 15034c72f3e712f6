// What becomes of results of optimal control: rows, tables, drawings.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include "bench/control/control_claim.h"
#include "bench/studies/control/control_views.h"
#include "bench/studies/control/gradient_rows.h"
#include "bench/studies/control/growth_rows.h"
#include "bench/studies/control/mpc_rows.h"
#include "bench/studies/control/seed_rows.h"
#include "problems/geometry_kinematics.h"
#include "problems/input_error.h"
#include "reports/drawing/scene_drawing.h"
#include "tests/round_trip.h"

namespace ricochet {
namespace {

TEST(ControlResults, SurviveTheRoundTripAndShowFailures) {
  ControlRun run;
  run.problem = "two_carts";
  run.discretisation = "FESD-J";
  run.status = "success";
  run.claimed_cost = 19.5;
  run.u = {{1.0}, {2.0}};
  run.T = 1;
  run.claimed = {{0, 1}, {{0.5}, {0.75}}, {{0}, {0.5}}};
  run.contacts = {"bumper"};
  run.friction = {0};
  run.impacts = {{0.5, 0, 2, {-0.25}}};
  run.force_t = {1};
  run.lambda_n = {{3}};
  run.lambda_t = {{-1}};
  run.replay_status = "inner_solver_failed";
  run.replay_message = "why";
  run.events = std::numeric_limits<double>::quiet_NaN();
  const ControlRun read = round_trip(run);
  EXPECT_SURVIVES(run);
  EXPECT_TRUE(std::isnan(read.events));
  EXPECT_EQ(control_table({run}).rows[0][7], "19.5");
  EXPECT_EQ(control_table({run}).rows[0][9], "-") << "no replay, no mismatch";
  run.replay_status = "success";
  EXPECT_EQ(control_table({run}).rows[0][10], "other") << "the impacts are not the same";
  run.replay_status = "inner_solver_failed";
  ASSERT_EQ(control_failures({run}).rows.size(), 1u);
  EXPECT_NE(control_failures({run}).rows[0][3].find("why"), std::string::npos);

  const ControlGradient gradient{"two_carts", "fesd", 4, {"q_1"}, {{1, 2}}, 1e-8, 1e-9};
  EXPECT_SURVIVES(gradient);
  EXPECT_EQ(gradient_details({gradient}).rows.size(), 2u);
}

/// Every element is closed, in the order in which it was opened; quotes end where they begin.
bool is_well_formed(const std::string& xml) {
  std::vector<std::string> open;
  for (auto at = xml.find('<'); at != std::string::npos; at = xml.find('<', at)) {
    const auto end = xml.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (std::ranges::count(tag, '"') % 2 != 0 || tag.find('<') != std::string::npos) return false;
    const std::string name = tag.substr(0, tag.find_first_of(" \n/", 1));
    if (tag.starts_with('/')) {
      if (open.empty() || "/" + open.back() != tag) return false;
      open.pop_back();
    } else if (!tag.ends_with('/')) {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty();
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::vector<double> numbers_of(const Vector& x) {
  return {x.begin(), x.end()};
}

/// The start of a problem, held for two seconds under forces of 1 N, with an impact of every contact after half a second.
DrawnMotion standing(const OptimalControlProblem& problem) {
  const ProblemInfo& info = problem.plant->info();
  DrawnMotion motion{.end = 2, .goal = problem.goal};
  motion.q = [q = info.q0](double) { return q; };
  motion.forces = [&info](double) {
    return SceneForces{Vector::Ones(info.n_u), Vector::Ones(info.n_c()), Vector::Ones(info.n_lambda_t)};
  };
  for (int i = 0; i < info.n_c(); ++i) motion.impacts.push_back({0.5, i});
  return motion;
}

TEST(Geometry, OfEveryOptimalControlProblemHasItsContacts) {
  for (const auto& entry : control_problems()) {
    const auto problem = entry.make({});
    const ProblemInfo& info = problem->plant->info();
    ASSERT_TRUE(info.geometry) << entry.id;
    ASSERT_EQ(problem->goal.size(), info.n_q) << entry.id;
    ASSERT_EQ(static_cast<int>(info.geometry->pairs.size()), info.n_c()) << entry.id;
    const bool is_squared = entry.id.starts_with("discs");  // its f_c is a difference of squared distances
    for (const Vector& q : {info.q0, problem->goal, Vector(info.q0 + Vector::Constant(info.n_q, 0.05))}) {
      const Vector gaps = problem->plant->gap(q);
      const Matrix J_n = problem->plant->normal_jacobian(q);
      for (const ShapePair& pair : info.geometry->pairs) {
        const auto contact = contact_of<double>(*info.geometry, pair, numbers_of(q));
        const double scale = is_squared ? contact.gap + 2 * 0.5 : 1;  // d^2 - r^2 = (d - r) (d + r),  r = 0.5 m
        EXPECT_NEAR(contact.gap * scale, gaps[pair.contact], 1e-14 * (1 + std::abs(gaps[pair.contact]))) << entry.id;
        const double slope = is_squared ? 2 * (contact.gap + 0.5) : 1;
        for (int k = 0; k < info.n_q; ++k)
          EXPECT_NEAR(slope * contact.J_n[static_cast<std::size_t>(k)], J_n(k, pair.contact), 1e-13) << entry.id;
      }
    }
  }
}

TEST(Drawings, OfOptimalControlShowGoalsForcesAndImpacts) {
  ASSERT_TRUE(is_well_formed("<a b=\"c\"><d/></a>"));
  ASSERT_FALSE(is_well_formed("<a><b></a></b>"));
  for (const auto& entry : control_problems()) {
    const auto problem = entry.make({});
    const auto n_c = static_cast<std::size_t>(problem->plant->n_c());
    const SceneFrames frames = scene_frames(*problem->plant, standing(*problem));
    EXPECT_TRUE(is_well_formed(frames.svg)) << entry.id;
    EXPECT_EQ(count(frames.svg, "<text"), 12u);
    EXPECT_EQ(count(frames.svg, ", impact</text>"), 1u) << "one frame is at the instant of all impacts";
    EXPECT_GE(count(frames.svg, "class=\"impact\""), n_c);
    EXPECT_EQ(count(frames.svg, "<g opacity=\"0.2\">"), 12u) << "the goal";
    EXPECT_GE(count(frames.svg, "class=\"force\" fill=\"#000000\""), 12u);
    EXPECT_EQ(count(frames.svg, "class=\"force\" fill=\"#ae017e\""), 12 * n_c);
    EXPECT_GE(frames.longest_force, 1);
    const std::string animation = scene_svg(*problem->plant, standing(*problem));
    EXPECT_TRUE(is_well_formed(animation)) << entry.id;
    EXPECT_EQ(count(animation, "class=\"force\" fill=\"#ae017e\""), n_c);
    EXPECT_EQ(count(animation, "class=\"impact\""), n_c);
    EXPECT_EQ(animation.find("nan"), std::string::npos);
  }
}

/// Numbers of the first list after `begin` up to `end`.
std::vector<double> list_in(const std::string& text, const std::string& begin, const std::string& end) {
  const auto from = text.find(begin) + begin.size();
  std::string list = text.substr(from, text.find(end, from) - from);
  std::ranges::replace_if(
      list, [](char c) { return c == ';' || c == ','; }, ' ');
  std::istringstream in(list);
  return {std::istream_iterator<double>(in), {}};
}

TEST(Drawings, FollowTheClaimAndItsForces) {
  // Cart 2 at 1 + t^3: the cubic through both ends.
  ControlSolution solution;
  solution.progress = {{0, 20, 1}, {3, 12, 0}};
  ControlTrajectory& trajectory = solution.trajectory;
  trajectory.u = Matrix::Ones(1, 2);
  trajectory.T = 2;
  trajectory.u(0, 1) = -3;
  for (const double t : {0.0, 2.0})
    trajectory.points.push_back({t, Vector{{0, 1 + t * t * t}}, Vector{{0, 3 * t * t}}, Vector{{5 + t}}, Vector(0)});
  trajectory.impulses = {{0.123456, 0, 100, Vector(0)}, {1.0, 0, 1e-9, Vector(0)}};
  const auto problem = make_control_problem("two_carts");
  ControlRun run;
  run.title = "one < two";
  run.problem = "two_carts";
  describe_claim(*problem, solution, run);
  const Chart progress = progress_chart({run}, "progress");
  ASSERT_EQ(progress.panels.front().series.size(), 1u);
  EXPECT_EQ(progress.panels.front().series.front().points, (Chart::Points{{3, 12}}))
      << "an axis of logarithms has no 0";
  ASSERT_EQ(run.impacts.size(), 1u) << "the other one is too small to be an impact";
  const auto folder = std::filesystem::temp_directory_path() / ("ricochet_frames_" + std::to_string(getpid()));
  const auto drawn = [&](const Figure& figure) {
    std::ifstream file(folder / figure.file);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const Figure frames = draw_frames(FigureFolder(folder), *problem, run, "frames");
  EXPECT_NE(drawn(frames).find("t = 0.12 s, impact"), std::string::npos);
  EXPECT_NE(frames.caption.find("the longest 7 N"), std::string::npos) << "of the last point";

  const std::string scene = drawn(draw_scene(FigureFolder(folder), *problem, run, "scene"));
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(is_well_formed(scene));
  // A wheel of cart 2 is the first circle that moves. The last frame is held for 0.8 s.
  const auto x =
      list_in(scene, "<animate attributeName=\"cx\" dur=\"3.80s\" repeatCount=\"indefinite\" values=\"", "\"");
  ASSERT_EQ(x.size(), 90u + 24u + 1u);
  const double metre = (x[90] - x[0]) / 8;
  EXPECT_GT(metre, 50) << "pixels";
  for (std::size_t k = 0; k <= 90; ++k) {
    const double t = 2.0 * static_cast<double>(k) / 90;
    EXPECT_NEAR(x[k] - x[0], metre * t * t * t, 0.011 + 3e-4 * metre * 8)
        << "coordinates are written with two decimals";
  }
}

/// Four guesses of one problem, one of them without a solution, and one of another.
std::vector<SeedRun> guesses() {
  std::vector<SeedRun> runs;
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    SeedRun run;
    run.problem = "discs";
    run.arguments = "--noise 0.1 --time-limit 60";
    run.seed = seed;
    run.status = seed == 3 ? "time_limit" : "success";
    run.message = seed == 3 ? "too late; violation 0.1" : "";
    run.iterations = 100 * static_cast<int>(seed);
    run.seconds = 2.0 * seed;
    run.cpu_seconds = seed;
    run.cost = 10.0 * seed;
    run.stationarity = seed == 4 ? "W" : "S";
    run.is_b_stationary = seed != 4;
    run.replay_status = seed < 3 ? "success" : seed == 4 ? "infeasible" : "";
    run.terminal = seed == 4 ? std::numeric_limits<double>::quiet_NaN() : 1e-9 * seed;
    runs.push_back(run);
  }
  runs.push_back(runs[2]);
  runs.back().problem = "three_boxes";
  return runs;
}

TEST(SeedResults, SurviveTheRoundTrip) {
  for (const auto& run : guesses()) EXPECT_SURVIVES(run);
  EXPECT_EQ(guesses()[1].command(), "ricochet control discs --noise 0.1 --time-limit 60 --seed 2");
}

TEST(SeedResults, TheTableCountsFailuresAndHasQuartilesOfTheRest) {
  const Table table = seed_table(guesses());
  ASSERT_EQ(table.rows.size(), 2u);
  const auto cell = [&](std::size_t row, const std::string& header) {
    const auto column = std::ranges::find(table.columns, header, &Table::Column::header);
    return table.rows[row].at(static_cast<std::size_t>(column - table.columns.begin()));
  };
  EXPECT_EQ(cell(0, "solved"), "3 of 4, 75 %");
  EXPECT_EQ(cell(0, "stationary"), "S 2, W 1");
  EXPECT_EQ(cell(0, "B"), "2");
  EXPECT_EQ(cell(0, "least cost"), "10");
  EXPECT_EQ(cell(0, "cost"), "15 | 20 | 30") << "of 10, 20, 40";
  EXPECT_EQ(cell(0, "worst cost"), "40");
  EXPECT_EQ(cell(0, "CPU s"), "1.5 | 2 | 3");
  EXPECT_EQ(cell(0, "iterations"), "150 | 200 | 300");
  EXPECT_EQ(cell(0, "replayed"), "2");
  EXPECT_EQ(cell(0, "off by"), "1.5e-09") << "of the two that were replayed";
  EXPECT_EQ(cell(1, "solved"), "0 of 1, 0 %");
  EXPECT_EQ(cell(1, "cost"), "-");
  EXPECT_EQ(cell(1, "stationary"), "-");

  const Table failed = seed_failures(guesses());
  ASSERT_EQ(failed.rows.size(), 2u);
  EXPECT_EQ(failed.rows[0][3], "too late");
  EXPECT_EQ(failed.rows[0][4], "3");
  EXPECT_EQ(seed_details(guesses()).rows.size(), 5u) << "no run is dropped";
}

/// The text in a table's row whose first cells are these.
std::string cell_of(const Table& table, const std::string& problem, const std::string& quantity,
                    const std::string& header) {
  const auto column = std::ranges::find(table.columns, header, &Table::Column::header);
  for (const auto& row : table.rows) {
    if (row[0] == problem && row[1] == quantity)
      return row.at(static_cast<std::size_t>(column - table.columns.begin()));
  }
  return "no such row";
}

TEST(ControlComparisons, OldRowsAreOfTheHomotopy) {
  for (const char* kind : {"control_run", "seed_run", "control_growth"}) {
    const auto old = nlohmann::json{{"kind", kind}, {"problem", "discs"}, {"status", "success"}};
    EXPECT_EQ(old.get<ControlRun>().method, "homotopy");
    EXPECT_EQ(old.get<SeedRun>().method, "homotopy");
    EXPECT_EQ(old.get<ControlGrowth>().method, "homotopy");
  }
  EXPECT_TRUE(seed_comparisons(guesses()).empty()) << "there is nothing to compare with";
}

TEST(ControlComparisons, SeedsHaveRatiosAndGoals) {
  std::vector<SeedRun> runs = guesses();
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    SeedRun run;
    run.problem = "discs";
    run.method = "shooting";
    run.arguments = "--method shooting";
    run.seed = seed;
    run.status = run.replay_status = "success";
    run.cpu_seconds = 0.1;
    run.cost = 10;
    run.stationarity = seed == 1 ? "B up to an edge" : seed == 2 ? "not B" : "B";
    run.is_b_stationary = seed != 2;
    run.terminal = seed == 4 ? 1e-8 : 1e-10;
    runs.push_back(run);
  }
  const nlohmann::json header = {{"goals",
                                  {{{"problem", "discs"}, {"quantity", "solved"}, {"at_least", 4}},
                                   {{"problem", "discs"}, {"quantity", "certified"}, {"at_least", 4}},
                                   {{"problem", "discs"}, {"quantity", "median cost"}, {"at_most", 0.5}},
                                   {{"problem", "discs"}, {"quantity", "median CPU time"}, {"at_most", 0.01}}}}};
  const Table table = comparison_table(seed_comparisons(runs), header);
  EXPECT_EQ(cell_of(table, "discs", "solved", "homotopy"), "3 of 4");
  EXPECT_EQ(cell_of(table, "discs", "solved", "shooting"), "4 of 4");
  EXPECT_EQ(cell_of(table, "discs", "solved", "goal"), ">= 4");
  EXPECT_EQ(cell_of(table, "discs", "solved", "kept"), "yes");
  EXPECT_EQ(cell_of(table, "discs", "certified", "shooting"), "3 of 4");
  EXPECT_EQ(cell_of(table, "discs", "certified", "kept"), "no");
  EXPECT_EQ(cell_of(table, "discs", "replayed to 1e-9", "shooting"), "3 of 4");
  EXPECT_EQ(cell_of(table, "discs", "replayed to 1e-9", "goal"), "-");
  EXPECT_EQ(cell_of(table, "discs", "median cost", "reached"), "0.5") << "10 of 20";
  EXPECT_EQ(cell_of(table, "discs", "median cost", "kept"), "yes");
  EXPECT_EQ(cell_of(table, "discs", "median CPU time", "reached"), "0.05") << "0.1 of 2";
  EXPECT_EQ(cell_of(table, "discs", "median CPU time", "kept"), "no");
  EXPECT_EQ(cell_of(seed_table(runs), "discs", "shooting", "stationary"), "B 2, B up to an edge 1, not B 1");
}

TEST(ControlComparisons, FiguresNameMethodAndLinearSolver) {
  std::vector<SeedRun> runs(3);
  for (SeedRun& run : runs) run.problem = "discs";
  runs[0].method = runs[1].method = "homotopy";
  runs[0].linear_solver = "mumps";
  runs[1].linear_solver = "ldl";
  runs[2].method = "shooting";
  for (std::size_t k = 0; k < runs.size(); ++k) runs[k].arguments = fmt::format("--noise 0.{}", k);
  const auto groups = seed_groups(runs);
  EXPECT_EQ(solver_name(groups[0], groups), "homotopy, mumps");
  EXPECT_EQ(solver_name(groups[2], groups), "shooting");
  runs[1].linear_solver = "mumps";
  EXPECT_EQ(solver_name(groups[0], groups), "homotopy, mumps --noise 0.0") << "two groups of one name";
}

TEST(ControlComparisons, LinearSolversHaveTimesPerIteration) {
  std::vector<SeedRun> runs = guesses();
  for (SeedRun& run : runs) {
    run.linear_solver = "mumps";
    run.solve_cpu_seconds = 0.05 * run.iterations;
  }
  EXPECT_TRUE(linear_solver_comparisons(runs).empty()) << "there is nothing to compare with";
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    SeedRun run = runs[seed - 1];
    run.linear_solver = "ldl";
    run.arguments += " --linear-solver ldl";
    run.status = seed < 3 ? "success" : "time_limit";
    run.solve_cpu_seconds = 0.01 * seed * run.iterations;
    EXPECT_SURVIVES(run);
    runs.push_back(run);
  }
  runs.push_back(runs.back());
  runs.back().method = "shooting";
  runs.back().arguments = "--method shooting --linear-solver ldl";
  const nlohmann::json header = {{"goals",
                                  {{{"problem", "discs"}, {"quantity", "guesses solved"}, {"at_least", 1}},
                                   {{"problem", "discs"}, {"quantity", "CPU ms per iteration"}, {"at_most", 0.6}}}}};
  const Table table = comparison_table(linear_solver_comparisons(runs), header, {"Linear solvers", "mumps", "ldl"});
  EXPECT_EQ(cell_of(table, "discs", "guesses solved", "mumps"), "3");
  EXPECT_EQ(cell_of(table, "discs", "guesses solved", "ldl"), "2");
  EXPECT_EQ(cell_of(table, "discs", "guesses solved", "kept"), "no");
  EXPECT_EQ(cell_of(table, "discs", "CPU ms per iteration", "mumps"), "50");
  EXPECT_EQ(cell_of(table, "discs", "CPU ms per iteration", "ldl"), "25") << "failed runs count";
  EXPECT_EQ(cell_of(table, "discs", "CPU ms per iteration", "reached"), "0.5");
  EXPECT_EQ(cell_of(table, "discs", "CPU ms per iteration", "kept"), "yes");
  EXPECT_EQ(cell_of(table, "three_boxes", "guesses solved", "mumps"), "no such row") << "mumps only";
  EXPECT_EQ(cell_of(seed_table(runs), "discs", "homotopy", "CPU ms/it."), "50 | 50 | 50");
}

TEST(ControlComparisons, GrowthHasExponentsOfBothMethods) {
  std::vector<ControlGrowth> runs;
  for (const char* method : {"homotopy", "shooting"}) {
    for (const int N : {10, 20, 40}) {
      ControlGrowth run;
      run.problem = "two_carts";
      run.method = method;
      run.intervals = N;
      run.status = run.again_status = "success";
      run.again_seconds = 1e-3 * N;
      run.iterations = 5;
      run.seconds = run.method == "shooting" ? 1e-3 * N : 1e-3 * N * N;
      run.cost = 20 - 0.1 * N;
      runs.push_back(run);
      EXPECT_SURVIVES(run);
    }
  }
  const Table table = comparison_table(growth_comparisons(runs), nlohmann::json::object());
  EXPECT_EQ(cell_of(table, "two_carts", "solved", "shooting"), "3 of 3");
  EXPECT_EQ(cell_of(table, "two_carts", "exponent of the time per iteration", "homotopy"), "2.00");
  EXPECT_EQ(cell_of(table, "two_carts", "exponent of the time per iteration", "shooting"), "1.00");
  EXPECT_EQ(cell_of(table, "two_carts", "cost of N by that of N / 4", "shooting"), "0.8421") << "16 by 19";
  EXPECT_EQ(growth_table(runs).rows.size(), 8u) << "a fit below the runs of each method";
}

TEST(ControlComparisons, UpdatesAreHeldAgainstThoseOnABranch) {
  const auto run_of = [](const char* method, std::vector<MpcRun::Update> updates) {
    MpcRun run;
    run.problem = "two_carts";
    run.method = method;
    run.disturbance = 0.003;
    run.status = "success";
    run.seconds = 1;
    run.cost = 12;
    run.updates = std::move(updates);
    return run;
  };
  const std::vector<MpcRun> runs = {
      run_of("homotopy", {{.t = 1, .status = "success", .has_plan = true, .kept_branch = true, .seconds = 0.2},
                          {.t = 2, .status = "time_limit", .message = "late", .seconds = 20}}),
      run_of("shooting", {{.t = 1, .status = "success", .has_plan = true, .seconds = 0.01},
                          {.t = 2, .status = "time_limit", .message = "late", .has_plan = true, .seconds = 0.03}})};
  for (const auto& run : runs) EXPECT_SURVIVES(run);
  const Table table = comparison_table(mpc_comparisons(runs), nlohmann::json::object());
  EXPECT_EQ(cell_of(table, "two_carts", "median update at 0.003", "reached"), "0.1") << "0.02 by 0.2";
  EXPECT_EQ(cell_of(table, "two_carts", "without a plan at 0.003", "homotopy"), "1 of 2");
  EXPECT_EQ(cell_of(table, "two_carts", "without a plan at 0.003", "shooting"), "0 of 2");
  EXPECT_EQ(mpc_table(runs).rows.size(), 2u);
  EXPECT_EQ(mpc_updates(runs).rows.size(), 4u);
}

}  // namespace
}  // namespace ricochet
