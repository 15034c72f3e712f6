// The study of the fastest runs: only runs that reach an error compete, and what its tables say of them.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "bench/studies/grid/fastest_choice.h"
#include "bench/studies/grid/fastest_rows.h"
#include "tests/small_experiment.h"

namespace ricochet {
namespace {

TEST(FastestStudy, OnlyRunsThatReachTheErrorCompete) {
  const auto runs = run_small_experiment(R"({"id": "fastest", "kind": "fastest", "title": "t", "description": "d.",
      "quick": true, "time_limit": 10, "levels": [0.1, 1e-3, 1e-10], "solvers": ["new", "kept"], "families": [
        {"name": "low order", "methods": ["moreau_jean"], "steps": {"from": 20, "to": 20000, "per_decade": 1}},
        {"name": "high order", "methods": ["fesd:radau-iia:3,elements=as_needed", "fesd_adaptive:radau-iia:3"],
         "steps": {"from": 5, "to": 50, "per_decade": 1}, "tolerances": {"from": 1e-2, "to": 1e-6, "per_decade": 1}}],
      "scenes": [{"problem": "belt_oscillator", "group": "g", "parameters": {"duration": 2}}]})")
                        .all<FastestRun>();
  ASSERT_EQ(runs.size(), 12u) << "two solvers, two families, three levels";
  int reached = 0;
  for (const FastestRun& run : runs) {
    EXPECT_TRUE(run.is_judged()) << run.reference_error;
    EXPECT_EQ(run.value("tried"), run.family() == "low order" ? 4 : 7);
    EXPECT_EQ(run.value("failed"), 0) << run.message;
    if (!run.is_reached()) continue;
    ++reached;
    EXPECT_LE(run.error, run.level()) << run.family() << " " << run.level();
    EXPECT_GE(run.error, 0.1 * run.reference_error);
    EXPECT_TRUE(run.metrics.are_known) << run.method;
    EXPECT_LT(run.metrics.position_error, 1) << "a finite one";
    EXPECT_FALSE(std::isnan(run.metrics.contact_dissipation)) << "the block stays on the belt";
    EXPECT_GT(run.solution_size, 0);
  }
  EXPECT_GE(reached, 8) << "both reach the first two levels";
  const auto kept = runs_of_solver(runs, "kept");
  ASSERT_EQ(kept.size(), 6u);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    EXPECT_EQ(kept[k].family(), runs[k].family());
    EXPECT_EQ(kept[k].level(), runs[k].level());
    EXPECT_EQ(kept[k].is_reached(), runs[k].is_reached()) << "to keep a solver changes no error";
  }
  EXPECT_FALSE(runs[2].is_reached()) << "no scheme of order one reaches 1e-10";
  std::set<std::pair<std::string, std::string>> winners;
  for (const FastestRun& run : runs) {
    if (run.is_reached()) winners.emplace(run.method, run.setting.text());
  }
  EXPECT_EQ(measured_runs(runs).size(), winners.size()) << "each once, whatever levels and solvers it wins";
}

class FastestTables : public testing::Test {
 protected:
  std::vector<FastestRun> runs;

  FastestTables() {
    add("first", "even", "ours", 10);
    add("first", "even", "theirs", 20);
    add("second", "even", "ours", 10);
    add("second", "even", "theirs", 80);
    add("third", "odd", "ours", 30);
    add("third", "odd", "theirs", -1);
    runs.back().message = "it broke";
    add("fourth", "odd", "ours", 5);
    add("fourth", "odd", "theirs", 5);
    for (std::size_t k = 6; k < 8; ++k) runs[k].reference_error = 1e-2;
  }

  void add(const std::string& scene, const std::string& group, const std::string& family, double microseconds) {
    FastestRun run;
    run.scene = scene;
    run.group = group;
    run.labels = {{"family", family}, {"solver", "new"}};
    run.conditions = {{"level", 1e-3}};
    run.reference_error = 1e-9;
    if (microseconds > 0) run.timing = {.median = 1e-6 * microseconds, .repetitions = 9};
    runs.push_back(run);
  }
};

TEST_F(FastestTables, RatiosAreThoseOfTheirTimes) {
  const Table fastest = fastest_table(runs);
  ASSERT_EQ(fastest.rows.size(), 4u);
  EXPECT_EQ(fastest.rows[0], (std::vector<std::string>{"first", "even", "10 / 20 (2)"}));
  EXPECT_EQ(fastest.rows[2].back(), "30 / -") << "not reached";
  EXPECT_EQ(fastest.rows[3].back(), "? / ?") << "not judged";
  const Table ratios = ratio_table(runs);
  ASSERT_EQ(ratios.rows.size(), 3u) << "two groups, and all";
  EXPECT_EQ(ratios.rows[0], (std::vector<std::string>{"even", "theirs", "4.00 (2..8, 2)"})) << "a geometric mean";
  EXPECT_EQ(ratios.rows[1].back(), "-") << "no scene of the group has both";
  EXPECT_EQ(ratios.rows[2].back(), ratios.rows[0].back());
}

TEST_F(FastestTables, WhatIsMissingHasAReason) {
  const Table missing = unreached_table(runs);
  ASSERT_EQ(missing.rows.size(), 2u);
  EXPECT_EQ(missing.rows[0], (std::vector<std::string>{"third", "theirs", "new", "1e-03", "it broke"}));
  EXPECT_EQ(missing.rows[1],
            (std::vector<std::string>{"fourth", "all", "new", "1e-03", "the reference is known to 1.0e-02 only"}));
  EXPECT_EQ(choice_table(runs).rows.size(), 7u) << "all that are reached";
}

TEST_F(FastestTables, TheChoiceReachesMostScenesAndIsFastest) {
  add("third", "odd", "slow", 45);
  runs.back().method = "m";
  const auto list = choices(runs);
  ASSERT_EQ(list.size(), 2u) << "a choice per group and level";
  const Choice& even = list[0];
  EXPECT_EQ(even.group, "even");
  EXPECT_EQ(even.scenes, 2);
  ASSERT_EQ(even.families.size(), 2u);
  EXPECT_EQ(even.families[0].name, "ours");
  EXPECT_EQ(even.families[0].slower, 1);
  EXPECT_NEAR(even.families[1].slower, 4, 1e-12) << "geometric mean of 2 and 8";
  EXPECT_NEAR(even.factor, 4, 1e-12);
  EXPECT_EQ(even.run.microseconds(), 10);
  EXPECT_EQ(even.never, std::vector<std::string>{"slow"});
  const Choice& odd = list[1];
  EXPECT_EQ(odd.scenes, 1) << "the fourth scene is not judged";
  EXPECT_EQ(odd.families[0].name, "ours");
  EXPECT_EQ(odd.families[1].name, "slow");
  EXPECT_NEAR(odd.factor, 1.5, 1e-12);
  EXPECT_EQ(odd.never, std::vector<std::string>{"theirs"});
  const Table table = which_to_take(runs);
  EXPECT_EQ(table.rows[0][2], "ours");
  EXPECT_EQ(table.rows[0][6], "4.0");
  EXPECT_EQ(
      table.rows[1].back(),
      "reaches it on 1 of 1 scenes, always the fastest; slow: 1 of 1, 1.5 times the fastest; not reached by theirs");
}

TEST_F(FastestTables, ReachingMoreScenesWinsOverSpeed) {
  add("first", "even", "narrow", 1);
  EXPECT_EQ(choices(runs)[0].families[0].name, "ours") << "narrow is ten times as fast, on one scene of two";
  EXPECT_EQ(choices(runs)[0].families.back().name, "narrow");
}

}  // namespace
}  // namespace ricochet
