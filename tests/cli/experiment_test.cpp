// `ricochet run-experiment`: part of an experiment, one without a file, several processes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

using nlohmann::json;

constexpr const char* kThreeMethods = R"({"id": "small", "title": "a small experiment", "problem": "bouncing_ball",
  "methods": [{"method": "fesd:gauss:1", "steps": [3, 40], "on_failure": "fesd:gauss:1,elements=as_needed"},
              {"method": "moreau_jean", "steps": [10, 20, 40]}, {"method": "cvode:adams", "tolerances": [1e-6]}]})";

std::vector<json> rows_of(const fs::path& results) {
  std::vector<json> rows;
  for (const auto& line : lines_of(read(results))) {
    rows.push_back(json::parse(line));
    if (rows.back()["kind"] != "row") rows.pop_back();
  }
  return rows;
}

TEST_F(Cli, RunsPartOfAnExperiment) {
  const std::string experiment = write("small.json", kThreeMethods), out = " --no-times -o " + folder.string();
  ASSERT_EQ(run("run-experiment " + experiment + out).code, 0);
  const Outcome part = run("run-experiment " + experiment + out + " --method 'moreau*' --method cvode:adams");
  ASSERT_EQ(part.code, 0) << part.text;
  const auto whole = rows_of(folder / "small.jsonl"), rows = rows_of(folder / "small_part.jsonl");
  ASSERT_EQ(rows.size(), 4u);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    json expected = whole[whole.size() - rows.size() + k];
    expected["experiment"] = "small_part";
    EXPECT_EQ(rows[k], expected);
  }
  const Outcome unknown = run("run-experiment " + experiment + out + " --method fesd");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_HAS(unknown.text,
             "--method = fesd: the experiment has no such name; it has cvode:adams  fesd:gauss:1  moreau_jean");
  EXPECT_EQ(run("run-experiment " + experiment + out + " --problem other").code, 2);
  EXPECT_EQ(run("run-experiment " + experiment + out + " --steps 10").code, 2) << "of which method?";
}

/// Those of its parts in which something is selected.
TEST_F(Cli, RunsPartOfAGroup) {
  const Outcome outcome = run("run-experiment pinning_order --quick --no-times -o " + folder.string() +
                              " --print-experiment --problem '*pulled_bead*'");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_EQ(json::parse(outcome.text)["id"], "pinning_slip_curved_part");
  const Outcome hard = run("run-experiment hard_cases -o " + folder.string() +
                           " --problem disc_in_chute --method fesd:gauss:3 --view group_1");
  EXPECT_EQ(hard.code, 0) << hard.text;
  EXPECT_EQ(lines_of(read(folder / "hard_cases_part.jsonl")).size(), 3u) << "header, one cell, end";
}

/// Of a campaign: whatever their number, shards give the file that one process writes.
TEST_F(Cli, ShardsMakeTheResultsOfOneProcess) {
  const std::string run_it = "run-experiment " + write("small.json", kThreeMethods) + " --no-times ";
  const std::string whole_folder = " -o " + (folder / "whole").string();
  ASSERT_EQ(run(run_it + whole_folder).code, 0);
  const std::string whole = undated(read(folder / "whole" / "small.jsonl"));
  for (const int n : {1, 2, 4, 9}) {  // of six pieces
    const fs::path shards = folder / std::to_string(n), merged = shards / "merged";
    for (int k = n; k >= 1; --k) {
      const Outcome shard =
          run(run_it + "--shard " + std::to_string(k) + "/" + std::to_string(n) + " --jobs 2 -o " + shards.string());
      ASSERT_EQ(shard.code, 0) << shard.text;
      const Outcome early = run(run_it + "--from-shards " + shards.string() + " -o " + merged.string());
      ASSERT_EQ(early.code, k == 1 && n > 1 ? 0 : 2) << early.text;
      if (n > 1 && k == 2) {
        EXPECT_HAS(early.text, "these are missing or not complete: 1");
      }
    }
    if (n == 1) continue;  // a shard 1/1 is the experiment itself
    EXPECT_EQ(undated(read(merged / "small.jsonl")), whole) << n << " shards";
  }
}

/// What a shard that was interrupted has made is taken over, and is in the results once.
TEST_F(Cli, AnInterruptedShardGoesOn) {
  const std::string run_it = "run-experiment " + write("small.json", kThreeMethods) + " --no-times ";
  const std::string out = " -o " + folder.string();
  ASSERT_EQ(run(run_it + out).code, 0);
  for (const char* shard : {"1/2", "2/2"}) ASSERT_EQ(run(run_it + "--shard " + shard + out).code, 0);
  const fs::path first = folder / "small.shard-1-of-2.jsonl", partial = first.string() + ".partial";
  const auto lines = lines_of(read(first));
  ASSERT_GT(lines.size(), 3u);
  std::ofstream(partial) << lines[0] << "\n" << lines[1] << "\n" << lines[2].substr(0, 20);
  fs::remove(first);
  const Outcome missing = run(run_it + "--from-shards " + folder.string() + " -o " + (folder / "merged").string());
  EXPECT_EQ(missing.code, 2) << "it is not complete";
  const Outcome again = run(run_it + "--shard 1/2" + out);
  ASSERT_EQ(again.code, 0) << again.text;
  EXPECT_HAS(again.text, "1 rows of an interrupted run are reused");
  ASSERT_EQ(run(run_it + "--from-shards " + folder.string() + " -o " + (folder / "merged").string()).code, 0);
  EXPECT_EQ(undated(read(folder / "merged" / "small.jsonl")), undated(read(folder / "small.jsonl")));
}

TEST_F(Cli, ShardsThatDoNotFitAreRefused) {
  const std::string run_it = "run-experiment " + write("small.json", kThreeMethods), out = " -o " + folder.string();
  for (const char* shard : {"0/2", "3/2", "1", "1/0", "-1/2", "a/b"})
    EXPECT_EQ(run(run_it + " --no-times --shard " + std::string(shard) + out).code, 2) << shard;
  const Outcome times = run(run_it + " --shard 1/2" + out);
  EXPECT_EQ(times.code, 2);
  EXPECT_HAS(times.text, "--no-times is required");
  EXPECT_EQ(run("run-experiment throughput --shard 1/2" + out).code, 2) << "it measures times alone";
  for (const char* shard : {"1/2", "2/2"}) ASSERT_EQ(run(run_it + " --no-times --shard " + shard + out).code, 0);
  const Outcome other = run(run_it + " --no-times --time-limit 7 --from-shards " + folder.string() + " -o " +
                            (folder / "merged").string());
  EXPECT_EQ(other.code, 2);
  EXPECT_HAS(other.text,
             "of the 2 shards of small these are of another experiment, other files or another program: 1, 2");
  const std::string text = read(folder / "small.shard-1-of-2.jsonl");
  std::ofstream(folder / "small.shard-1-of-2.jsonl") << std::regex_replace(text, std::regex(R"("piece":\d+,)"), "");
  const Outcome without =
      run(run_it + " --no-times --from-shards " + folder.string() + " -o " + (folder / "merged").string());
  EXPECT_EQ(without.code, 2);
  EXPECT_HAS(without.text, "a row does not name its piece of the work");
}

/// A folder may have shards of before: of another number, and made by what was another program or experiment then.
TEST_F(Cli, ShardsOfBeforeAreNotMistaken) {
  const std::string run_it = "run-experiment " + write("small.json", kThreeMethods) + " --no-times ";
  const std::string before = run_it + "--time-limit 7 ", out = " -o " + folder.string();
  const auto merge = [&](const char* merged) {
    return run(run_it + "--from-shards " + folder.string() + " -o " + (folder / merged).string());
  };
  ASSERT_EQ(run(run_it + out).code, 0);
  const std::string whole = undated(read(folder / "small.jsonl"));
  for (const char* shard : {"1/2", "2/2"}) ASSERT_EQ(run(before + "--shard " + shard + out).code, 0);
  for (const char* shard : {"1/3", "2/3"}) ASSERT_EQ(run(run_it + "--shard " + shard + out).code, 0);
  const Outcome early = merge("early");
  EXPECT_EQ(early.code, 2);
  EXPECT_HAS(early.text, "of the 2 shards of small these are of another experiment");
  EXPECT_HAS(early.text, "of the 3 shards of small these are missing or not complete: 3");

  ASSERT_EQ(run(run_it + "--shard 3/3" + out).code, 0);
  write("small.shard-5-of-4.jsonl", "");  // a number that no shard has
  const Outcome merged = merge("merged");
  ASSERT_EQ(merged.code, 0) << merged.text;
  EXPECT_EQ(undated(read(folder / "merged" / "small.jsonl")), whole);

  for (const char* shard : {"1/2", "2/2"}) ASSERT_EQ(run(run_it + "--shard " + shard + out).code, 0);
  const Outcome twice = merge("twice");
  EXPECT_EQ(twice.code, 2);
  EXPECT_HAS(twice.text, "it contains more than one complete set of small, of 2 and 3 shards");
}

/// The motion that an experiment records is drawn by its scene, too, and the page plays it.
TEST_F(Cli, APageShowsTheSceneInMotion) {
  json document = json::parse(kThreeMethods);
  document["trajectory"] = {{"method", "fesd:gauss:2"}, {"steps", 40}};
  const Outcome outcome = run("run-experiment " + write("moving.json", document.dump()) + " --no-times -o " +
                              folder.string() + " --page " + (folder / "page").string());
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(read(folder / "page/experiments/small_scene.svg"), "<animate attributeName=\"cy\"");
}

/// An option with one value leaves the next word to the command.
TEST_F(Cli, OptionsThatMayBeRepeatedTakeOneWord) {
  for (const char* option : {"--method 'fesd:gauss:*'", "--problem two_balls_spring", "--set time_limit=7"}) {
    const Outcome outcome = run(std::string("run-experiment --print-experiment ") + option + " two_balls_order");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    EXPECT_EQ(json::parse(outcome.text)["id"], "two_balls_order_part");
  }
  const Outcome word = run("run -p bouncing_ball -m fesd:gauss:2 -N 10 --sensitivity q0:0 v0:0");
  EXPECT_EQ(word.code, 2);
  EXPECT_HAS(word.text, "v0:0");
}

TEST_F(Cli, RunsAStudyWithoutAFile) {
  const std::string scene =
      write("block.json", R"({"params": {"mu": "0.3"}, "q0": ["0", "0"], "v0": ["2", "0"], "T": "1",
    "M": [["1", "0"], ["0", "1"]], "f": ["0", "-9.81"],
    "contacts": [{"name": "floor", "gap": "q[1]", "mu": "mu", "Jt": [["1", "0"]]}]})");
  const std::string arguments = "run-experiment --scene " + scene +
                                ",mu=0.4 -m moreau_jean -m cvode:adams --steps 10..100:4 "
                                "--tolerance 1e-4..1e-6 -o " +
                                folder.string();
  const Outcome outcome = run(arguments + " --no-times --view orders");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_HAS(outcome.text, "Observed orders");
  const auto rows = rows_of(folder / "block-mu=0.4_moreau_jean_cvode-adams_steps-10..100-4_tolerance-1e-4..1e-6.jsonl");
  ASSERT_EQ(rows.size(), 5u + 3u);
  EXPECT_HAS(rows[0]["command"].get<std::string>(), "--scene " + scene + " --set mu=0.4");
  EXPECT_TRUE(rows[0]["error"].is_number());

  // Printed, saved and run it is the same.
  const Outcome printed = run(arguments + " --print-experiment");
  ASSERT_EQ(printed.code, 0);
  json document = json::parse(printed.text);
  document["id"] = "saved";
  ASSERT_EQ(run("run-experiment " + write("saved.json", document.dump()) + " --no-times -o " + folder.string()).code,
            0);
  auto saved = rows_of(folder / "saved.jsonl");
  for (auto& row : saved) row["experiment"] = rows[0]["experiment"];
  EXPECT_EQ(saved, rows);

  EXPECT_HAS(run("run-experiment").text, "a name, or --problem or --scene for one without a file, is required");
  EXPECT_EQ(run("run-experiment").code, 2);
  EXPECT_EQ(run("run-experiment zeno --scene " + scene).code, 2);
  EXPECT_EQ(run("run-experiment -p a -p b").code, 2);
}

TEST_F(Cli, SharesTheWorkOfWhatIsNotTimed) {
  const std::string experiment = write("small.json", kThreeMethods),
                    command = "run-experiment " + experiment + " --no-times -o ";
  const auto file_of = [&](const std::string& jobs) {
    const Outcome outcome = run(command + (folder / ("j" + jobs)).string() + " --jobs " + jobs);
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    const auto lines = lines_of(read(folder / ("j" + jobs) / "small.jsonl"));
    std::string text;
    for (std::size_t k = 1; k < lines.size(); ++k) text += lines[k] + "\n";  // without the header, which has a date
    return text;
  };
  const std::string one = file_of("1");
  EXPECT_EQ(file_of("2"), one);
  EXPECT_EQ(file_of("5"), one);
  const Outcome timed = run("run-experiment " + experiment + " --jobs 2 -o " + (folder / "timed").string());
  EXPECT_EQ(timed.code, 2);
  EXPECT_HAS(timed.text, "--jobs = 2: --no-times is required, or --times exclusive or --times shared");
  EXPECT_EQ(run("run-experiment scale --quick --jobs 2 -o " + (folder / "timed").string()).code, 2);
  EXPECT_EQ(run("run-experiment report --quick --no-times --jobs 2 -o " + (folder / "timed").string()).code, 2)
      << "a part of it is timed, which is said before the others are run";
  EXPECT_FALSE(fs::exists(folder / "timed"));
  EXPECT_EQ(run(command + (folder / "j0").string() + " --jobs 0").code, 2);
}

/// Cells without times do not depend on what ran beside them.
TEST_F(Cli, HardCasesAreTheSameHoweverTheirWorkIsShared) {
  const std::string command =
      "run-experiment hard_cases --problem disc_in_chute --method moreau_jean --method fesd:gauss:3";
  const auto file_of = [&](const std::string& options) {
    const fs::path results = folder / ("results" + options);
    const Outcome outcome = run(command + " --no-times" + options + " -o '" + results.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    return undated(read(results / "hard_cases_part.jsonl"));
  };
  EXPECT_EQ(file_of(" --jobs 2"), file_of(""));
  for (const json& cell : rows_of(folder / "results" / "hard_cases_part.jsonl"))
    EXPECT_EQ(cell.at("timing").at("repetitions"), 0) << cell;
  EXPECT_EQ(run(command + " --jobs 2 -o " + folder.string()).code, 2) << "the wall time of a cell would be spoiled";
}

/// Killed, it leaves no process behind that would keep the results locked.
TEST_F(Cli, GoesOnAtOnceAfterAKilledRunOfSeveralProcesses) {
  const std::string experiment =
      write("long.json", R"({"id": "long", "problem": "bouncing_ball", "reference": null, "methods": [
    {"method": "moreau_jean", "steps": [400000, 400001, 400002, 400003, 400004, 400005, 400006, 400007]}]})");
  const std::string command = "run-experiment " + experiment + " --no-times --jobs 2 -o " + folder.string();
  run_command("timeout -s KILL 0.3 " + std::string(RICOCHET_PROGRAM) + " " + command);
  const Outcome again = run(command);
  EXPECT_EQ(again.code, 0) << again.text;
  EXPECT_EQ(rows_of(folder / "long.jsonl").size(), 8u);
}

}  // namespace
}  // namespace ricochet::cli
