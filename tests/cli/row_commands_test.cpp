// The command of a row repeats its run, in every study whose rows are runs.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

using nlohmann::json;

/// An experiment of seconds. Its scenes have parameters that are not the default ones.
struct RowExperiment {
  const char *name, *text;
};

std::ostream& operator<<(std::ostream& out, const RowExperiment& experiment) {
  return out << experiment.name;
}

const RowExperiment kExperiments[] = {
    {"method_grid",
     R"({"id": "small", "title": "t", "problem": "bouncing_ball", "parameters": {"e": 0.7, "duration": 0.9},
      "times": false, "methods": [{"method": "moreau_jean", "steps": [50, 100]}, {"method": "fesd:gauss:3", "steps": [20]},
                  {"method": "event_driven", "tolerances": [1e-6, 1e-9]}]})"},
    {"contact_cost", R"({"id": "small", "title": "t", "kind": "contact_cost", "methods": ["moreau_jean"]})"},
    {"scale", R"({"id": "small", "title": "t", "kind": "scale", "steps": 10, "time_limit": 100, "runs": [
      {"problem": "bead_row", "set": {"speed": 0.5}, "sizes": [2, 4], "methods": ["moreau_jean", "soft_step"]}]})"},
    {"fastest",
     R"({"id": "small", "title": "t", "kind": "fastest", "time_limit": 10, "levels": [0.1, 1e-3], "families": [
        {"name": "a", "methods": ["fesd:radau-iia:3,elements=as_needed"], "steps": {"from": 10, "to": 40, "per_decade": 2}}],
      "scenes": [{"problem": "bouncing_ball", "group": "g", "parameters": {"e": 0.6, "duration": 1}}]})"},
    {"bounce",
     R"({"id": "small", "title": "t", "kind": "bounce", "restitution": [0.8], "bounces": [1], "step_lengths": [0.001],
      "methods": ["moreau_jean", "event_driven"]})"},
    {"hold", R"({"id": "small", "title": "t", "kind": "hold", "fractions": [0.9, 1.1], "step_lengths": [0.01],
      "methods": ["moreau_jean", "penalty"]})"},
    {"lift", R"({"id": "small", "title": "t", "kind": "lift", "friction": [0.5], "speeds": [2], "step_lengths": [0.001],
      "methods": ["moreau_jean"]})"},
    {"overlap", R"({"id": "small", "title": "t", "kind": "overlap", "depths": [0.01], "step_lengths": [0.01],
      "methods": ["moreau_jean", "xpbd"]})"},
    {"calibrate", R"({"id": "small", "title": "t", "kind": "calibrate", "step_lengths": [0.01, 0.001],
      "scenes": [{"problem": "sliding_block", "parameters": {"mu": 0.4}}], "methods": ["moreau_jean"]})"},
    {"hard_cases", R"({"id": "small", "title": "t", "kind": "hard_cases", "time_limit": 10, "also": [],
      "defaults": {"steps": {"first_order": 200, "high_order": 50}, "tolerance": 1e-7},
      "only_method": ["moreau_jean", "event_driven"],
      "cases": [{"id": "a", "group": "g", "title": "t", "problem": "bouncing_ball", "parameters": {"e": 0.6, "duration": 0.9},
                 "motions": [{"reference": {}}]}]})"},
};

class RowsOf : public Cli, public testing::WithParamInterface<RowExperiment> {};

/// Rows that the program should be able to repeat.
std::vector<json> repeatable(const fs::path& results) {
  std::vector<json> rows;
  for (const auto& line : lines_of(read(results))) {
    const json row = json::parse(line);
    if (row.contains("command") && row.value("status", "") == "success" && row["command"] != "") rows.push_back(row);
  }
  return rows;
}

TEST_P(RowsOf, AreRepeatedByTheirCommands) {
  const Outcome made = run("run-experiment " + write("small.json", GetParam().text) + " --quick -o " + folder.string());
  ASSERT_EQ(made.code, 0) << made.text;
  const auto rows = repeatable(folder / "small.jsonl");
  ASSERT_FALSE(rows.empty()) << made.text;
  std::mt19937 draw(std::random_device{}());
  const json& row = rows[draw() % rows.size()];
  const std::string command = row["command"];
  // Scene files of the project are named from its folder.
  const Outcome single = output_of("cd " + test_data("../..") + " && " + RICOCHET_PROGRAM +
                                   command.substr(std::string("ricochet").size()) + " --json");
  ASSERT_EQ(single.code, 0) << command << "\n" << single.text;
  const json again = json::parse(single.text);
  EXPECT_EQ(again["status"], row["status"]) << command;
  EXPECT_EQ(again["counters"], row["counters"]) << command;
  if (row["error"].is_null()) return;
  EXPECT_EQ(again["error"], row["error"]) << command;
  EXPECT_EQ(again["reference"]["uncertainty"], row["reference_error"]) << command;
}

INSTANTIATE_TEST_SUITE_P(EveryStudy, RowsOf, testing::ValuesIn(kExperiments),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace ricochet::cli
