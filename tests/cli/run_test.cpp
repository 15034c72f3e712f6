// `ricochet run`: its error, its events, its document.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "reference/certified/certified_motion.h"
#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

using nlohmann::json;

TEST_F(Cli, PrintsTheErrorAndWhatItIsMeasuredAgainst) {
  const Outcome known = run("run -p two_balls_spring -m fesd:gauss:4 -N 200");
  EXPECT_EQ(known.code, 0);
  EXPECT_HAS(known.text, "\nerror      ");
  EXPECT_HAS(known.text, "\ntruth      reference/data/ground_truth.json, P2_two_balls_spring; its own error is below ");
  if (reference::certified::can_certify()) {
    const Outcome proven = run("run -p bouncing_ball -m fesd:gauss:4 -N 50");
    EXPECT_HAS(proven.text, "\ntruth      proven to ");
    EXPECT_HAS(proven.text, "decimals by Taylor series in ball arithmetic; its own error is below ");
  }
  const Outcome computed = run("run -p block_on_feet -m moreau_jean -N 100");  // without a proof
  EXPECT_HAS(computed.text, "reference  CVODE with event location, Adams and BDF at 1e-14 and 1e-13; its own error");
  const Outcome without = run("run -p bouncing_ball -m fesd:gauss:4 -N 50 --no-reference");
  EXPECT_EQ(without.text.find("error  "), std::string::npos) << without.text;
  const Outcome none = run("run -p bouncing_ball --set e=0.5 --set duration=2 -m moreau_jean -N 50");
  EXPECT_EQ(none.code, 0) << none.text;
  EXPECT_HAS(none.text, "error      ");
}

/// The error is that of the row of a study, to the last digit.
TEST_F(Cli, TheErrorIsThatOfTheStudies) {
  const std::string out = (folder / "results").string();
  for (const char* problem : {"two_balls_spring", "bouncing_ball"}) {
    const Outcome outcome =
        run(std::string("run-experiment --no-times -m moreau_jean -N 100 -o ") + out + " -p " + problem);
    ASSERT_EQ(outcome.code, 0) << outcome.text;
    const std::string results = out + "/" + problem + "_moreau_jean_steps-100.jsonl";
    const json row = json::parse(lines_of(read(results)).at(1));
    const Outcome single =
        run(row.at("command").get<std::string>().substr(std::string("ricochet ").size()) + " --json");
    const json document = json::parse(single.text);
    EXPECT_EQ(document["error"], row["error"]) << problem;
    EXPECT_EQ(document["reference"]["uncertainty"], row["reference_error"]) << problem;
  }
}

TEST_F(Cli, PrintsAllEventsOrSome) {
  const std::string ball =
      "run -p bouncing_ball --set e=0.9 --set duration=8 -m event_driven --tolerance 1e-8 --no-reference";
  const auto impacts = [](const std::string& text) {
    std::size_t n = 0;
    for (const auto& line : lines_of(text)) n += line.starts_with("  impact ");
    return n;
  };
  const json document = json::parse(run(ball + " --json").text);
  const std::size_t n = document["events"].size();
  EXPECT_GT(n, 20u);
  EXPECT_EQ(impacts(run(ball).text), n);
  const Outcome some = run(ball + " --events 3");
  EXPECT_EQ(impacts(some.text), 3u);
  EXPECT_HAS(some.text, "and " + std::to_string(n - 3) + " more");
  EXPECT_EQ(run(ball + " --events 3 --json").code, 2) << "the document has them all";
  EXPECT_EQ(run(ball + " --events -1").code, 2);
}

TEST_F(Cli, PrintsADocumentAlone) {
  const std::string csv = (folder / "motion.csv").string();
  const Outcome outcome =
      run_command(std::string(RICOCHET_PROGRAM) + " run -p bouncing_ball -m fesd:gauss:2 -N 50 --json --csv " + csv +
                  " 2>/dev/null");
  EXPECT_EQ(outcome.code, 0);
  const json document = json::parse(outcome.text);
  EXPECT_EQ(document["status"], "success");
  EXPECT_LT(document["error"], 1e-9);
  EXPECT_HAS(read(csv), "t,q[0],v[0]\n");
  const Outcome failed = run("run -p two_balls_spring -m fesd:gauss:1 -N 80 --json");
  EXPECT_EQ(failed.code, 1);
  EXPECT_EQ(json::parse(failed.text)["reference"]["how"], "the run failed");
  const json schema = json::parse(run("schema run").text);
  for (const auto& [field, value] : document.items()) EXPECT_TRUE(schema["properties"].contains(field)) << field;
  EXPECT_HAS(run("schema run --page").text, "| `events[].Lambda_n` |");
}

}  // namespace
}  // namespace ricochet::cli
