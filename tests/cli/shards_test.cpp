// `--shard` and `--from-shards` of `ricochet run-experiment` and `ricochet ensemble`, study by study.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

using nlohmann::json;

/// An experiment of seconds of a study whose rows can be shared.
struct Small {
  const char *name, *text;
};

std::ostream& operator<<(std::ostream& out, const Small& small) {
  return out << small.name;
}

const Small kSmallExperiments[] = {
    {"control_seeds", R"({"id": "small", "title": "t", "kind": "control_seeds", "runs": [
      {"problem": "two_carts", "arguments": "--intervals 4 --noise 0.1 --sigma-0 0.1 --factor 0.1", "seeds": 5, "time_limit": 100}]})"},
    {"contact_solvers",
     R"({"id": "small", "title": "t", "kind": "contact_solvers", "method": "moreau_jean", "steps": 12,
      "per_scene": 3, "solvers": ["pgs", "lemke,facets=8"], "accuracy": 1e-8})"},
    {"homotopy", R"({"id": "small", "title": "t", "kind": "homotopy", "problem": "two_balls_spring",
      "families": ["radau-iia"], "stages": 2, "steps": [50, 60], "margin": 0, "guess": ["pivoting", "ballistic"]})"},
    {"friction_ramp",
     R"({"id": "small", "title": "t", "kind": "friction_ramp", "grid": 5, "duration": 0.5, "v_0": [0, -1],
      "methods": [{"method": "fesd:radau-iia:3", "steps": 5}, {"method": "moreau_jean", "steps": 20, "stride": 2},
                  {"method": "event_driven", "tolerance": 1e-8, "stride": 4}],
      "facets": {"directions": 2, "load": 1.1, "methods": [{"method": "moreau_jean,facets=4", "facets": 4, "steps": 10},
                                                           {"method": "fesd:radau-iia:3", "facets": 0, "steps": 2}]}})"},
    {"optimal_control", R"({"id": "small", "title": "t", "kind": "optimal_control", "runs": [
      {"problem": "two_carts", "fesd": "--intervals 4 --simulate --sigma-0 0.1 --factor 0.1",
       "time_stepping": "--intervals 4 --simulate --sigma-0 1"}]})"},
    {"control_growth", R"({"id": "small", "title": "t", "kind": "control_growth", "disturbance": 0.001, "runs": [
      {"problem": "two_carts", "arguments": "--simulate --sigma-0 0.01 --max-branches 0", "intervals": [3, 4, 5]}]})"},
    {"control_mpc", R"({"id": "small", "title": "t", "kind": "control_mpc", "disturbances": [0.001, 0.01], "runs": [
      {"problem": "two_carts", "homotopy": "--intervals 4 --simulate --sigma-0 0.01 --max-branches 0",
       "shooting": "--intervals 4 --explore 3"}]})"},
    {"control_gradient", R"({"id": "small", "title": "t", "kind": "control_gradient", "problem": "two_carts",
      "control": [[4], [4], [3], [3], [2], [0], [-1], [-1], [0], [0]],
      "methods": [{"method": "fesd:radau-iia:3", "steps": [1, 2]}, {"method": "moreau_jean,theta=1", "steps": [8, 32]}]})"},
    {"scale", R"({"id": "small", "title": "t", "kind": "scale", "steps": 10, "time_limit": 100, "runs": [
      {"problem": "bead_row", "sizes": [2, 4, 8], "methods": ["moreau_jean", "moreau_jean,solver=newton", "soft_step"]}]})"},
    {"zeno", R"({"id": "small", "title": "t", "kind": "zeno", "tableaus": ["radau-iia:2", "gauss:2", "gauss:3"],
      "restitution": [0.5], "step_lengths": {"from": 0.1, "to": 0.01, "per_decade": 2}, "methods": ["fesd:radau-iia:2"]})"},
};

class ShardsOf : public Cli, public testing::WithParamInterface<Small> {
 protected:
  void make_shards(const std::string& run_it, int n, const fs::path& shards) {
    for (int k = 1; k <= n; ++k) {
      const Outcome shard =
          run(run_it + " --shard " + std::to_string(k) + "/" + std::to_string(n) + " -o " + shards.string());
      ASSERT_EQ(shard.code, 0) << shard.text;
    }
  }
};

/// Without times the results are those of one process, whatever the number of shards, and each has a part of the rows.
TEST_P(ShardsOf, MakeTheResultsOfOneProcess) {
  const std::string run_it = "run-experiment " + write("small.json", GetParam().text) + " --no-times";
  const Outcome one = run(run_it + " -o " + (folder / "whole").string());
  ASSERT_EQ(one.code, 0) << one.text;
  EXPECT_EQ(one.text.find("CPU s"), std::string::npos) << one.text;
  EXPECT_EQ(one.text.find("nan"), std::string::npos) << one.text;
  const std::string whole = undated(read(folder / "whole" / "small.jsonl"));
  const std::size_t n_rows = lines_of(whole).size() - 2;  // without header and end
  for (const int n : {2, 4}) {
    const fs::path shards = folder / std::to_string(n), merged = shards / "merged";
    make_shards(run_it, n, shards);
    std::size_t most = 0;
    for (const auto& entry : fs::directory_iterator(shards))
      most = std::max(most, lines_of(read(entry.path())).size() - 2);
    EXPECT_LT(most, n_rows) << "one of the shards has made everything";
    const Outcome merge = run(run_it + " --from-shards " + shards.string() + " -o " + merged.string());
    ASSERT_EQ(merge.code, 0) << merge.text;
    EXPECT_EQ(undated(read(merged / "small.jsonl")), whole) << n << " shards";
  }
}

INSTANTIATE_TEST_SUITE_P(EveryStudy, ShardsOf, testing::ValuesIn(kSmallExperiments),
                         [](const auto& test) { return std::string(test.param.name); });

class TimedShards : public Cli {
 protected:
  const fs::path shards = folder / "shards", merged = folder / "merged";
  std::string run_it, merge;

  void SetUp() override {
    Cli::SetUp();
    run_it = "run-experiment " + write("small.json", R"({"id": "small", "title": "t", "kind": "scale", "steps": 10,
      "time_limit": 100, "runs": [{"problem": "bead_row", "sizes": [2, 4], "methods": ["moreau_jean", "soft_step"]}]})") +
             " --quick";
    merge = run_it + " --from-shards " + shards.string() + " -o " + merged.string();
  }
  Outcome shard(const std::string& options) { return run(run_it + " --shard " + options + " -o " + shards.string()); }
  json header() { return json::parse(lines_of(read(merged / "small.jsonl")).front()); }
};

TEST_F(TimedShards, AreMadeWhereSomethingIsPromisedOfTheirTimes) {
  const Outcome refused = shard("1/2");
  EXPECT_EQ(refused.code, 2);
  EXPECT_HAS(refused.text,
             "--shard = 1/2: --no-times is required, or --times exclusive or --times shared, since runs beside each "
             "other would spoil the times");
  EXPECT_EQ(shard("1/2 --times exclusive --no-times").code, 2);
  const Outcome other = shard("1/2 --times alone");
  EXPECT_EQ(other.code, 2);
  EXPECT_HAS(other.text, "--times = alone: exclusive or shared is required");
  const Outcome beside = shard("1/2 --times exclusive --jobs 2");
  EXPECT_EQ(beside.code, 2);
  EXPECT_HAS(beside.text, "--times = exclusive: shared is required with --jobs 2");

  for (const char* k : {"1/2", "2/2"}) ASSERT_EQ(shard(k + std::string(" --times exclusive")).code, 0);
  const Outcome exclusive = run(merge);
  ASSERT_EQ(exclusive.code, 0) << exclusive.text;
  EXPECT_EQ(header().at("times"), "exclusive");
  EXPECT_EQ(exclusive.text.find("while other programs ran"), std::string::npos);
  EXPECT_HAS(exclusive.text, "us per step");
}

/// One shard whose times are worth nothing marks them all, and whatever shows the results says so.
TEST_F(TimedShards, AreMarkedWhereOtherWorkRan) {
  const std::string sentence = "Times of these results were measured while other programs ran on the machine";
  ASSERT_EQ(shard("1/2 --times exclusive").code, 0);
  ASSERT_EQ(shard("2/2 --times shared --jobs 2").code, 0);
  const Outcome shared = run(merge + " --page " + (folder / "page").string());
  ASSERT_EQ(shared.code, 0) << shared.text;
  EXPECT_EQ(header().at("times"), "shared");
  EXPECT_HAS(shared.text, sentence);
  EXPECT_HAS(read(folder / "page/experiments/small.html"), sentence);
  const std::string file = (merged / "small.jsonl").string();
  EXPECT_HAS(run("show " + file).text, sentence);
  EXPECT_HAS(run("table --latex " + file).text, "% " + sentence);
  const fs::path page = folder / "RESULTS.md";
  ASSERT_EQ(run("results " + file + " -o " + page.string() + " --tables " + (folder / "tables").string()).code, 0);
  EXPECT_HAS(read(page), "**" + sentence);

  // Exclusive ones that are asked for replace those that are shared.
  ASSERT_EQ(shard("2/2 --times exclusive").code, 0);
  ASSERT_EQ(run(merge + " --times exclusive").code, 0);
  EXPECT_EQ(header().at("times"), "exclusive");
}

/// Times of a grid of methods are those of one session, that of the merge.
TEST_F(Cli, TheMergeMeasuresTheTimesOfAMethodGrid) {
  const std::string run_it = "run-experiment " + write("small.json", R"({"id": "small", "title": "t",
    "problem": "bouncing_ball", "methods": [{"method": "moreau_jean", "steps": [10, 20]}]})") +
                             " --quick ";
  const std::string from = " --from-shards " + folder.string() + " -o " + (folder / "merged").string();
  for (const char* k : {"1/2", "2/2"})
    ASSERT_EQ(run(run_it + "--times shared --shard " + k + " -o " + folder.string()).code, 0);
  EXPECT_EQ(lines_of(read(folder / "small.shard-1-of-2.jsonl")).size(), 3u) << "a row without times";
  const Outcome refused = run(run_it + from);
  EXPECT_EQ(refused.code, 2);
  EXPECT_HAS(refused.text, "--no-times is required, or --times exclusive or --times shared");
  const Outcome merge = run(run_it + "--times exclusive" + from);
  ASSERT_EQ(merge.code, 0) << merge.text;
  const auto lines = lines_of(read(folder / "merged" / "small.jsonl"));
  ASSERT_EQ(lines.size(), 6u) << "header, two runs and their times, end";
  EXPECT_EQ(json::parse(lines[0]).at("times"), "exclusive") << "those of the merge, which alone has measured";
}

/// The fastest runs are nothing without times.
TEST_F(Cli, ShardsOfTheFastestRunsHaveTimes) {
  const std::string run_it = "run-experiment " + write("small.json", R"({"id": "small", "title": "t", "kind": "fastest",
    "levels": [1e-2], "time_limit": 2, "families": [{"name": "a", "methods": ["moreau_jean"], "steps": {"from": 10, "to": 100, "per_decade": 2}},
      {"name": "b", "methods": ["fesd:gauss:2"], "steps": {"from": 5, "to": 20, "per_decade": 2}}],
    "scenes": [{"problem": "bouncing_ball", "group": "g"}, {"problem": "sliding_block", "group": "g"}]})") +
                             " --quick";
  const Outcome refused = run(run_it + " --no-times --shard 1/2 -o " + folder.string());
  EXPECT_EQ(refused.code, 2);
  EXPECT_HAS(refused.text,
             "--shard = 1/2: --times exclusive or --times shared, and not --no-times, is required: experiments of kind "
             "fastest say nothing without times");
  const Outcome session = run("run-experiment contact_cost --times exclusive --shard 1/2 -o " + folder.string());
  EXPECT_EQ(session.code, 2);
  EXPECT_HAS(session.text,
             "--shard = 1/2: 1/1 is required: experiments of kind contact_cost measure all times in one session");
  ASSERT_EQ(run(run_it + " --times shared -o " + (folder / "whole").string()).code, 0);
  for (const char* k : {"1/2", "2/2"})
    ASSERT_EQ(run(run_it + " --times shared --shard " + k + " -o " + folder.string()).code, 0);
  ASSERT_EQ(run(run_it + " --from-shards " + folder.string() + " -o " + (folder / "merged").string()).code, 0);
  const auto whole = lines_of(read(folder / "whole" / "small.jsonl")),
             merged = lines_of(read(folder / "merged" / "small.jsonl"));
  ASSERT_EQ(whole.size(), merged.size());
  for (std::size_t k = 1; k + 1 < whole.size(); ++k) {
    for (const char* field : {"scene", "labels", "conditions", "values", "reference_error"})
      EXPECT_EQ(json::parse(whole[k]).at(field), json::parse(merged[k]).at(field)) << field;
  }
}

/// An ensemble's shards are its runs, one part after the other; so is what an interrupted one goes on with.
TEST_F(Cli, ShardsOfAnEnsembleAreItsRuns) {
  const std::string run_it =
      "ensemble -p two_balls_spring --vary k=log-uniform:1e3:1e5 --vary e=values:0.5:0.7:0.9 --runs 7 "
      "-m event_driven --tolerance 1e-8 ";
  const fs::path whole = folder / "whole" / "spring.csv", merged = folder / "merged" / "spring.csv";
  ASSERT_EQ(run(run_it + "-o " + whole.string()).code, 0);
  for (const int n : {2, 4}) {  // of 21 runs
    const fs::path shards = folder / std::to_string(n);
    std::string joined;
    for (int k = 1; k <= n; ++k) {
      const std::string of = std::to_string(k) + "/" + std::to_string(n);
      const Outcome shard = run(run_it + "--threads 2 --shard " + of + " -o " + (shards / "spring.csv").string());
      ASSERT_EQ(shard.code, 0) << shard.text;
      const std::string text =
          read(shards / ("spring.shard-" + std::to_string(k) + "-of-" + std::to_string(n) + ".csv"));
      joined += k == 1 ? text : text.substr(text.find('\n') + 1);
    }
    EXPECT_EQ(joined, read(whole)) << n;
    fs::remove_all(merged.parent_path());
    const Outcome merge = run(run_it + "--from-shards " + shards.string() + " -o " + merged.string());
    ASSERT_EQ(merge.code, 0) << merge.text;
    EXPECT_EQ(read(merged), read(whole)) << n;
  }
  const fs::path second = folder / "2" / "spring.shard-2-of-2.csv";
  const std::string text = read(second);
  std::ofstream(second.string() + ".partial") << text.substr(0, text.size() / 2);
  fs::remove(second);
  fs::remove_all(merged.parent_path());
  const std::string from = run_it + "--from-shards " + (folder / "2").string() + " -o " + merged.string();
  const Outcome missing = run(from);
  EXPECT_EQ(missing.code, 2);
  EXPECT_HAS(missing.text, "it is missing, or not complete");
  EXPECT_FALSE(fs::exists(merged.parent_path())) << "nothing is begun that cannot be made";
  ASSERT_EQ(run(run_it + "--shard 2/2 -o " + (folder / "2" / "spring.csv").string()).code, 0);
  EXPECT_EQ(read(second), text);
  EXPECT_EQ(run(from).code, 0);
  EXPECT_EQ(read(merged), read(whole));
  fs::remove_all(merged.parent_path());
  const Outcome other = run(from + " --seed 4");
  EXPECT_EQ(other.code, 2);
  EXPECT_HAS(other.text, "it is of another ensemble or another program");
  EXPECT_EQ(run(run_it + "--shard 3/2 -o " + whole.string()).code, 2);
  EXPECT_EQ(run(run_it + "--shard 25/25 -o " + whole.string()).code, 0);
  EXPECT_EQ(lines_of(read(folder / "whole" / "spring.shard-25-of-25.csv")).size(), 1u) << "no run is left for it";
}

}  // namespace
}  // namespace ricochet::cli
