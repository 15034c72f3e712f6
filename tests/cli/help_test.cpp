// What holds of every command: its help, and where it writes.
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

/// Each command has examples, and of itself.
TEST_F(Cli, ExamplesAreOfTheirSubcommand) {
  const char* commands[] = {"list",    "run",  "audit",          "ensemble", "export", "contacts", "contacts export",
                            "control", "mpc",  "run-experiment", "show",     "report", "results",  "contacts solve",
                            "check",   "fuzz", "schema",         "table",    "truth"};
  for (const std::string command : commands) {
    const Outcome help = run(command + " --help");
    EXPECT_EQ(help.code, 0);
    int n = 0;
    for (const auto& line : lines_of(help.text)) {
      if (!line.starts_with("  ricochet ")) continue;
      EXPECT_TRUE(line.starts_with("  ricochet " + command + " ")) << line;
      ++n;
    }
    EXPECT_GT(n, 0) << command;
  }
}

/// Help is printed for a command that exists.
TEST_F(Cli, UnknownCommandsHaveNoHelp) {
  const Outcome unknown = run("runn --help");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_HAS(unknown.text, "command of ricochet = 'runn': unknown; did you mean run?");
  const Outcome nested = run("contacts solv --help");
  EXPECT_EQ(nested.code, 2);
  EXPECT_HAS(nested.text, "command of ricochet contacts = 'solv': unknown; did you mean solve?");
  EXPECT_EQ(run("contacts --help").code, 0);
}

/// Where nothing can be written, nothing is computed: each of these would take seconds, and some minutes.
TEST_F(Cli, OutputsAreCheckedBeforeTheWork) {
  const std::string file = write("file", "text"), results = (folder / "r").string();
  const std::string long_run = " -p two_balls_spring -m moreau_jean -N 100000000 --time-limit 100 ";
  const std::pair<std::string, std::string> cases[] = {
      {"run" + long_run + "--csv " + file + "/motion.csv", "motion = " + file + "/motion.csv: cannot be written"},
      {"run" + long_run + "--plot " + file, "--plot = " + file + ": cannot be written: it is not a folder"},
      {"run-experiment two_balls_order -o " + file + "/out", "results folder = " + file + "/out: cannot be written"},
      {"run-experiment two_balls_order -o " + results + " --page " + file,
       "folder of the site = " + file + ": cannot be written"},
      {"fuzz --scenes 1000 -o " + file, "results folder = " + file + ": cannot be written"},
      {"ensemble -p bouncing_ball --vary e=uniform:0.5:0.9 --runs 100000000 -m moreau_jean -N 1000 -o " + file +
           "/e.csv",
       "-o = " + file + "/e.csv: it cannot be written"},
      {"control three_boxes --explore 1000 --plot " + file, "--plot = " + file + ": cannot be written"},
      {"export -p bouncing_ball -o " + file + "/scene.json", "cannot be written"},
      {"results /nonexistent.jsonl -o " + file + "/R.md", "results page = " + file + "/R.md: cannot be written"},
      {"results /nonexistent.jsonl -o " + results + "/R.md --tables " + file, "folder of the tables = " + file},
      {"report /nonexistent.jsonl -o " + file, "folder of the site = " + file + ": cannot be written"},
      {"check /nonexistent.jsonl --baseline x --junit " + file + "/j.xml", "JUnit file = " + file + "/j.xml"},
  };
  for (const auto& [arguments, message] : cases) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << "\n" << outcome.text;
    EXPECT_HAS(outcome.text, message);
  }
  EXPECT_EQ(read(file), "text");
}

}  // namespace
}  // namespace ricochet::cli
