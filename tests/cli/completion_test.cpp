// What a shell is told may follow: its own script is sourced in it, and asked as the shell asks.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

class Completion : public Cli {
 protected:
  /// COMPREPLY of bash at the end of a line "ricochet ...", split into words as bash does it.
  std::vector<std::string> in_bash(const std::string& line) {
    const std::string path = fs::path(RICOCHET_PROGRAM).parent_path();
    const std::string script = write("ask.sh", "PATH=" + path + R"(:$PATH
      source <(ricochet completion bash)
      COMP_LINE=$1 COMP_POINT=${#1}
      $(complete -p ricochet | sed 's/.*-F \([^ ]*\) .*/\1/') ricochet
      printf '%s\n' "${COMPREPLY[@]}"
    )");
    const Outcome outcome = run_command("bash " + script + " '" + line + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    return lines_of(outcome.text);
  }
  void expect(const std::string& line, const std::vector<std::string>& words) {
    EXPECT_EQ(in_bash(line), words) << line;
  }
  void expect_among(const std::string& line, const std::vector<std::string>& words) {
    const auto found = in_bash(line);
    for (const auto& word : words) EXPECT_NE(std::ranges::find(found, word), found.end()) << line << " -> " << word;
  }
};

TEST_F(Completion, OfCommandsAndOptions) {
  expect("ricochet ru", {"run", "run-experiment"});
  expect("ricochet contacts ", {"export", "impact-laws", "merit", "record", "solve"});
  expect("ricochet run --ste", {"--step-length", "--steps"});
  expect("ricochet check --base", {"--baseline", "--baselines"});
  expect("ricochet completion ", {"bash", "zsh"});
  EXPECT_EQ(std::ranges::count(in_bash("ricochet "), "precision"), 0) << "a former word";
}

TEST_F(Completion, OfNames) {
  expect("ricochet run --problem two_b", {"two_balls_spring"});
  expect("ricochet run -p two_b", {"two_balls_spring"});
  expect("ricochet audit two_b", {"two_balls_spring"});
  expect("ricochet audit two_balls_spring anitescu_p", {"anitescu_potra"});
  expect("ricochet control two_", {"two_carts"});
  expect("ricochet list woodp", {"woodpecker_toy"});
  expect("ricochet run-experiment two_balls_o", {"two_balls_order"});
  expect("ricochet run-experiment zeno --set restit", {"restitution="});
  expect("ricochet run --problem bouncing_ball --set h", {"height="});
  expect("ricochet ensemble -p sphere_pile --vary mu", {"mu="});
  expect("ricochet control two_carts --discretisation ", {"fesd", "time_freezing", "time_stepping"});
  expect("ricochet contacts solve x.hdf5 --solver int", {"interior_point"});
  expect_among("ricochet run --method ", {"fesd", "moreau_jean", "cvode"});
}

/// Bash replaces what follows the last : or = only.
TEST_F(Completion, InsideOfAWord) {
  expect_among("ricochet run --method fesd:gau", {"gauss:4"});
  expect("ricochet run --method fesd:gauss:3,elem", {"3,elements="});
  expect("ricochet run --method fesd:gauss:3,elements=as", {"as_needed"});
  expect("ricochet run --problem=two_b", {"two_balls_spring"});
}

TEST_F(Completion, OfTheTablesOfResults) {
  const std::string experiment = write("small.json", kExperiment);
  ASSERT_EQ(run("run-experiment " + experiment + " --quick --no-times -o " + folder.string()).code, 0);
  expect("ricochet show " + (folder / "small.jsonl").string() + " --view ord", {"orders"});
}

/// Where nothing is offered a shell completes files.
TEST_F(Completion, LeavesFilesToTheShell) {
  for (const char* line :
       {"ricochet run --scene ", "ricochet show ", "ricochet run -o ", "ricochet run --problem nowhere"})
    expect(line, {""});
  EXPECT_HAS(run("completion bash").text, "complete -o default -F");
}

/// Without the completion system of zsh, whose words stand for themselves here.
TEST_F(Completion, InZsh) {
  if (run_command("command -v zsh").code != 0) GTEST_SKIP() << "zsh is not installed";
  const std::string path = fs::path(RICOCHET_PROGRAM).parent_path();
  const std::string script = write("ask.zsh", "path=(" + path + R"( $path)
    compdef() { }
    _files() { print files }
    compadd() { while [[ $1 != -- ]]; do shift; done; shift; (( $# )) && print -l -- $@ }
    source <(ricochet completion zsh)
    ask() { local -a words; words=("$@"); local CURRENT=$# PREFIX=${@[-1]}; _ricochet }
    ask ricochet ru
    ask ricochet run --problem two_b
    ask ricochet run --method fesd:gauss:3,elem
    ask ricochet run --scene ''
  )");
  EXPECT_EQ(run_command("zsh -f " + script).text,
            "run\nrun-experiment\ntwo_balls_spring\nfesd:gauss:3,elements=\nfiles\n");
}

}  // namespace
}  // namespace ricochet::cli
