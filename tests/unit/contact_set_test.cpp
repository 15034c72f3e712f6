// Contact problems as lines of JSON, directories of them, samples of a run, and the tables of a set.
#include "bench/contacts/contact_set.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "bench/contacts/contact_sampler.h"
#include "bench/contacts/contact_set_tables.h"
#include "bench/contacts/merit_study.h"
#include "bench/studies/contact_solvers/contact_solve.h"
#include "problems/input_error.h"
#include "reports/performance_profile.h"
#include "tests/contact_problems.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST(ContactSet, ReadsTheLineThatItWrites) {
  for (const FrictionLaw law : {FrictionLaw::coulomb, FrictionLaw::associated}) {
    StoredContactProblem stored{.problem = random_problem(law, 4, 2, 9, 5), .title = "four \"contacts\""};
    if (law == FrictionLaw::coulomb) stored.problem.contacts[1].present = 0.1;
    stored.solution = Vector::LinSpaced(12, 0.1, 1.0 / 3);
    const StoredContactProblem read = read_contact_problem(json::parse(contact_problem_json(stored).dump()), "line");
    EXPECT_EQ(read.title, stored.title);
    EXPECT_EQ(read.problem.law, law);
    EXPECT_EQ(read.problem.contacts[1].present, stored.problem.contacts[1].present);
    EXPECT_EQ((Matrix(sparse_matrix(read.problem.G)) - Matrix(sparse_matrix(stored.problem.G))).norm(), 0);
    EXPECT_EQ((read.problem.b - stored.problem.b).norm(), 0) << "all digits";
    EXPECT_EQ((read.solution - stored.solution).norm(), 0);
    EXPECT_EQ(read.guess.size(), 0);
  }
}

TEST(ContactSet, SaysWhatIsWrongWithALine) {
  const json good = contact_problem_json({.problem = random_problem(FrictionLaw::coulomb, 2, 1, 6, 1)});
  const auto expect_error = [&](const std::string& pointer, const json& value, const std::string& part) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    try {
      read_contact_problem(bad, "x.jsonl, line 3");
      ADD_FAILURE() << part;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), "x.jsonl, line 3: " + part);
    }
  };
  expect_error("/law", "newton", "law: coulomb or associated is required");
  expect_error("/contacts", json::array(), "contacts: a list of 1 to 10000 is required");
  expect_error("/contacts/1/n_t", 3, "contacts[1].n_t: a whole number from 0 to 2 is required");
  expect_error("/contacts/1/mu", -0.5, "contacts[1].mu: >= 0 is required");
  expect_error("/contacts/0/present", "x", "contacts[0].present: a finite number is required");
  expect_error("/b", {1, 2}, "b: 4 numbers are required");
  expect_error("/b/2", nullptr, "b[2]: a finite number is required");
  expect_error("/G/0/0", 4, "G[0][0]: a whole number from 0 to 3 is required");
  expect_error("/G", json::array(), "G: row 0 has 0 on the diagonal: > 0");
  expect_error("/color", 1, "color: no field of a contact problem");
  json without = good;
  without.erase("G");
  EXPECT_THROW(read_contact_problem(without, "line"), InputError);
}

TEST(ContactSet, IsADirectoryOfFiles) {
  const fs::path folder = fs::temp_directory_path() / ("ricochet_contact_set_" + std::to_string(getpid()));
  fs::create_directories(folder / "inner");
  EXPECT_THROW(read_contact_problems(folder.string()), InputError) << "no contact problem";
  const auto line = [](unsigned seed) {
    return contact_problem_json({.problem = random_problem(FrictionLaw::coulomb, 2, 1, 6, seed)}).dump() + "\n";
  };
  std::ofstream(folder / "b.jsonl") << line(1) << "\n" << line(2);
  std::ofstream(folder / "inner/a.json") << line(3);
  std::ofstream(folder / "README") << "no problem";
  const auto problems = read_contact_problems(folder.string());
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_EQ(problems[0].title, (folder / "b.jsonl").string() + ":1");
  EXPECT_EQ(problems[2].problem.b[0], random_problem(FrictionLaw::coulomb, 2, 1, 6, 3).b[0]);
  fs::remove_all(folder);
}

TEST(ContactSampler, KeepsProblemsOfTheWholeRun) {
  const ContactProblem problem = random_problem(FrictionLaw::coulomb, 1, 0, 2, 1);
  for (const int n : {3, 10, 1000}) {
    ContactSampler sampler("run", 10);
    const Vector r = Vector::Zero(1);
    for (int step = 0; step < n; ++step) {
      sampler.before(step, problem, r);
      sampler.after(problem, r, ContactStatus::solved);
    }
    const auto kept = sampler.take();
    ASSERT_EQ(kept.size(), static_cast<std::size_t>(std::min(n, 10))) << n;
    EXPECT_EQ(kept.front().title, "run, step 1");
    const int last = std::stoi(kept.back().title.substr(std::string("run, step ").size()));
    EXPECT_GT(last, n - 2 * std::max(1, n / 10)) << "a tenth of the run is left, twice that where every k-th is seen";
  }
}

TEST(PerformanceProfile, CountsRatiosToTheBest) {
  constexpr double kFailed = std::numeric_limits<double>::infinity();
  const PerformanceProfile profile({"a", "b"}, {{1, 4, kFailed, kFailed}, {3, 1, 7, kFailed}});
  EXPECT_EQ(profile.share(0, 1), 0.25);
  EXPECT_EQ(profile.share(1, 1), 0.5);
  EXPECT_EQ(profile.share(0, 4), 0.5);
  EXPECT_EQ(profile.solved(0), 0.5);
  EXPECT_EQ(profile.solved(1), 0.75) << "a problem that nobody solves counts";
  EXPECT_EQ(profile.largest_ratio(), 4);
}

TEST(ContactSetSolutions, CountsWhatIsDeclinedAsNotSolved) {
  std::vector<StoredContactProblem> problems;
  for (unsigned seed = 1; seed <= 3; ++seed)
    problems.push_back({.problem = random_problem(FrictionLaw::associated, 3, 2, 12, seed), .title = "associated, x"});
  problems.push_back({.problem = random_problem(FrictionLaw::coulomb, 5, 0, 3, 1), .title = "redundant, x"});
  const auto set = solve_set(problems, {"newton", "staggered"});
  const PerformanceProfile profile = set.profile(1e-8);
  EXPECT_EQ(profile.solved(0), 1);
  EXPECT_EQ(profile.solved(1), 0.25) << "it has no associated law";
  EXPECT_NE(set.solutions[1][0].declined, "");
  EXPECT_TRUE(set.all_are_solved()) << "but for what was declined";
  EXPECT_THROW(solve_set(problems, {"pgss"}), InputError) << "no solver, which is not the same as one that declines";
  std::vector<Conditioning> how_hard;
  for (const auto& stored : problems) how_hard.push_back(conditioning_of(stored));
  const Table conditioning = conditioning_table(how_hard);
  ASSERT_EQ(conditioning.rows.size(), 3u) << "two scenes, and all";
  EXPECT_EQ(conditioning.rows[1][5], "100 %") << "five contacts of three coordinates";
  EXPECT_EQ(conditioning.rows[1][6], "40 %");
  EXPECT_EQ(conditioning.rows[2][5], "25 %");
  EXPECT_EQ(internal_force_table(problems, set, 1e-8).rows[0][1], "1");
}

TEST(ContactSolvers, ShowsSolversOnProblemsOfEachSize) {
  std::vector<ContactSolve> solves;
  const auto add = [&](const char* scene, int contacts, const char* solver, const char* status, double violation,
                       double seconds) {
    ContactSolve solve;
    solve.scene = scene;
    solve.contacts = solve.rows = contacts;
    solve.condition = 1;
    solve.problem = std::string(scene) + ", step 1";
    solve.solver = solver;
    solve.status = status;
    solve.violation = violation;
    solve.seconds = seconds;
    solves.push_back(solve);
  };
  add("ball", 1, "pgs", "solved", 0, 1e-6);
  add("ball", 1, "lemke", "solved", 1e-12, 3e-6);
  add("pile", 40, "pgs", "solved", 1e-5, 1e-3);
  add("pile", 40, "lemke", "solved", 1e-9, 2e-3);
  add("pile", 120, "pgs", "iteration limit", 1e-2, 1);
  add("pile", 120, "lemke", "declined", std::nan(""), 0);
  const PerformanceProfile all = contact_profile(solves, 1, 1e-8), many = contact_profile(solves, 10, 1e-8);
  EXPECT_EQ(all.n_problems(), 3u);
  EXPECT_NEAR(all.solved(0), 1. / 3, 1e-15) << "a solution that violates the laws is none";
  EXPECT_NEAR(all.share(1, 1), 1. / 3, 1e-15);
  EXPECT_EQ(many.n_problems(), 2u);
  EXPECT_EQ(many.solved(0), 0);
  const Table table = solver_table(solves, 1e-8);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"pgs", "3", "1", "1 (1)", "-", "-", "-", "0 (0)"}));
  EXPECT_EQ(table.rows[1][3], "1e+03 (2e+03)") << "the median of 3 us and 2 ms";
  EXPECT_EQ(recorded_conditioning(solves).rows.back()[1], "3");
  EXPECT_EQ(solver_scene_table(solves, 1e-8).rows.size(), 4u);
}

/// What the study is to show, for few draws: ours stays within a factor, FCLib's follows the units.
TEST(MeritStudy, ShowsThatFclibsMeritFollowsTheUnits) {
  const MeritStudy study = run_merit_study(3);
  const auto band = [](const std::string& cell) {
    const auto middle = cell.find(" .. ");
    return std::pair{std::stod(cell.substr(0, middle)), std::stod(cell.substr(middle + 4))};
  };
  const auto& rows = study.of_velocities.rows;
  EXPECT_EQ(rows[0][1], rows[1][1]) << "violation() does not see whether bodies are kilograms or grams";
  EXPECT_EQ(rows[0][1], rows[2][1]);
  const auto [low, high] = band(rows.back()[1]);
  EXPECT_GT(low, 0.1) << "small values belong to small distances";
  EXPECT_GT(band(rows[2][3]).second, 50 * band(rows[0][3]).second) << "in tonnes";
}

}  // namespace
}  // namespace ricochet
