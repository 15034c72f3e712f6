// The commands of the README files run as they are printed: those of the ```sh blocks, in a folder that looks like the
// source tree, each file from its first command to its last. What is not run is listed here with its reason, and is
// parsed all the same, with the names in it. So are commands inside of the text, between backticks.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <regex>

#include "bench/commands/program.h"
#include "bench/experiment/experiment_file.h"
#include "methods/registry.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/registry.h"
#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

const fs::path kSource = fs::path(RICOCHET_TEST_DATA) / ".." / "..";

/// Beginnings of commands that are not run, and why.
const std::map<std::string, std::string> kNotRun = {
    {"./run build", "it builds"},
    {"apt-get install", "it changes the machine"},
    {"cmake --install", "tests/package/installed_copy does"},
    {"cmake -S examples/cpp", "tests/package/installed_copy builds it"},
    {"PATH=", "the test sets it"},
    {"cmake ", "it builds with other flags, for an hour"},
    {"out/numbers/tests/numbers", "built by a command before that is not run"},
    {"mkdir -p out/corpus", "for the next one"},
    {"ASAN_OPTIONS=", "half an hour"},
    {"ricochet run-experiment zeno", "ten seconds; bench_smoke runs it"},
    {"ricochet control push_box_goal", "half a minute"},
    {"ricochet control discs", "half a minute"},
    {"ricochet control three_boxes", "half a minute"},
    {"ricochet mpc push_box_goal", "a minute; cli_test.cpp has one of two carts"},
    {"ricochet contacts ", "FCLib may not be built; cli_test.cpp has one"},
};

struct Document {
  std::string file;                   ///< in the source tree
  std::vector<std::string> commands;  ///< of its blocks
  std::vector<std::string> inlined;
};

void PrintTo(const Document& document, std::ostream* out) {
  *out << document.file;
}

/// Without the comment at its end.
std::string without_comment(const std::string& line) {
  const auto hash = line.find(" #");
  const std::string text = line.substr(0, hash);
  const auto end = text.find_last_not_of(' ');
  return end == std::string::npos ? "" : text.substr(0, end + 1);
}

/// Commands that go on after a backslash are joined, those after && are taken apart.
std::vector<std::string> commands_of(const std::string& block) {
  std::vector<std::string> commands;
  std::string command;
  for (const auto& line : lines_of(block)) {
    command += without_comment(line);
    if (command.ends_with("\\")) {
      command.pop_back();
      continue;
    }
    for (std::size_t at = 0; !command.empty();) {
      const auto end = command.find(" && ");
      commands.push_back(command.substr(0, end));
      at = end == std::string::npos ? command.size() : end + 4;
      command.erase(0, at);
    }
  }
  return commands;
}

/// ```sh ... ```, or another language.
std::vector<std::string> blocks_of(const std::string& text, const std::string& language) {
  std::vector<std::string> blocks;
  const std::string begin = "\n```" + language + "\n", end = "\n```";
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
    const std::size_t from = at + begin.size();
    blocks.push_back(text.substr(from, text.find(end, from) - from) + "\n");
  }
  return blocks;
}

/// `ricochet ...`, with no word in capitals that stands for something else.
std::vector<std::string> inlined_commands(const std::string& text) {
  static const std::regex command("`(ricochet [^`]*|\\./run [^`]*)`"), placeholder("\\b[A-Z]{2,}\\b|\\.\\.\\.");
  std::vector<std::string> commands;
  for (std::sregex_iterator at(text.begin(), text.end(), command), end; at != end; ++at) {
    std::string found = (*at)[1];
    std::ranges::replace(found, '\n', ' ');
    if (!std::regex_search(found, placeholder)) commands.push_back(found);
  }
  return commands;
}

/// Records of former measurements (MEASUREMENTS.md, RESULTS.md) say what was run then.
std::vector<Document> documents() {
  std::vector<Document> list;
  for (fs::recursive_directory_iterator at(kSource), end; at != end; ++at) {
    const std::string name = at->path().filename();
    const bool not_ours = name == "out" || name == "node_modules" || name.starts_with('.');
    if (at->is_directory() && not_ours) at.disable_recursion_pending();
    if (name != "README.md" && name != "CONTRIBUTING.md") continue;
    const std::string text = read(at->path());
    Document document{fs::relative(at->path(), kSource), {}, inlined_commands(text)};
    for (const auto& block : blocks_of(text, "sh")) {
      for (auto& command : commands_of(block)) document.commands.push_back(std::move(command));
    }
    if (!document.commands.empty() || !document.inlined.empty()) list.push_back(std::move(document));
  }
  std::ranges::sort(list, {}, &Document::file);
  return list;
}

/// Without the actions, a command line is only read.
void take_actions_away(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands({})) {
    command->callback(nullptr);
    take_actions_away(*command);
  }
}

/// What the option or argument of this name was given.
std::vector<std::string> given(const CLI::App& command, const std::string& name) {
  const CLI::Option* option = command.get_option_no_throw(name);
  return option ? option->results() : std::vector<std::string>();
}

/// @throws CLI::ParseError or InputError where the program would; but the name of a command may stand alone
void parse(const std::string& line) {
  CLI::App app;
  int exit_code = 0;
  add_commands(app, exit_code);
  take_actions_away(app);
  try {
    app.parse(line, /*program_name_included=*/true);
  } catch (const CLI::Success&) {  // --help
    return;
  } catch (const CLI::RequiredError&) {
    if (app.get_subcommands().empty() || !app.remaining(true).empty()) throw;
  }
  const CLI::App& command = *app.get_subcommands().front();
  const std::string name = command.get_name();
  if (name != "run-experiment" && name != "control" && name != "mpc") {  // patterns, and methods of optimal control
    for (const auto& method : given(command, "--method")) {
      if (!method.starts_with("external:")) make_method(method);  // a program beside the command, not beside the test
    }
    for (const auto& problem : given(command, "--problem")) {
      if (problem.find(".json") != std::string::npos) continue;
      const bool is_of_control = std::ranges::count(control_problems(), problem, &ControlEntry::id) > 0;
      if (name == "export" && is_of_control) continue;
      make_problem(problem);
    }
  }
  for (const auto& problem : given(command, "problem")) {
    if (problem.find(".json") == std::string::npos) make_control_problem(problem);
  }
  for (const auto& experiment : given(command, "experiment")) {
    for (const auto& part : read_experiment_file(experiment).parts()) read_experiment_file(part);
  }
}

void check_words(const std::string& command) {
  static const std::string script = read(kSource / "run");
  if (command.starts_with("ricochet ")) {
    EXPECT_NO_THROW(parse(command.substr(0, command.find(" > ")))) << command;
  } else if (command.starts_with("./run ")) {
    std::istringstream words(command.substr(6));
    std::string word;
    words >> word;
    EXPECT_HAS(script, "\n  " + word + ")\n");
  }
}

std::string reason_not_to_run(const std::string& command) {
  for (const auto& [begin, reason] : kNotRun) {
    if (command.starts_with(begin)) return reason;
  }
  return "";
}

class DocumentedCommands : public Cli, public testing::WithParamInterface<Document> {};

TEST_P(DocumentedCommands, Run) {
  for (const char* name : {"bench", "examples", "methods", "problems", "reference", "reports", "tests"})
    fs::create_directory_symlink(fs::canonical(kSource / name), folder / name);
  fs::create_directory(folder / "out");
  // bench/ensemble/README.md shows the fields of an ensemble, not a file.
  write("study.json", R"({"problem": "two_balls_spring", "vary": ["e=grid:0.5:0.9:5"], "method": "moreau_jean",
      "steps": 100})");
  // Debian's Python, with its numpy, before any other.
  const std::string path = fs::path(RICOCHET_PROGRAM).parent_path();
  for (const auto& command : GetParam().inlined) check_words(command);
  for (const auto& command : GetParam().commands) {
    check_words(command);
    if (!reason_not_to_run(command).empty()) continue;
    const std::string script = write("command.sh", command + "\n");
    const Outcome outcome =
        run_command("cd " + folder.string() + " && PATH=" + path + ":/usr/bin:$PATH bash -e " + script);
    EXPECT_EQ(outcome.code, 0) << command << "\n" << outcome.text;
  }
}

INSTANTIATE_TEST_SUITE_P(Files, DocumentedCommands, testing::ValuesIn(documents()), [](const auto& test) {
  std::string name = test.param.file;
  std::ranges::replace_if(
      name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
});

/// The scene of the README, and the command below it.
TEST_F(Cli, TheSceneOfTheReadmeDoesWhatItSays) {
  const std::string text = read(kSource / "README.md");
  const auto scenes = blocks_of(text, "json");
  ASSERT_EQ(scenes.size(), 1u);
  write("block.json", scenes.front());
  const auto commands = inlined_commands(text);
  const auto command = std::ranges::find_if(
      commands, [](const auto& line) { return line.find("--scene block.json") != std::string::npos; });
  ASSERT_NE(command, commands.end());
  const std::string path = fs::path(RICOCHET_PROGRAM).parent_path();
  const Outcome outcome = run_command("cd " + folder.string() + " && PATH=" + path + ":$PATH; " + *command);
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  for (const char* event : {"impact   t = ", "wall", "slip", "stick"}) EXPECT_HAS(outcome.text, event);
}

}  // namespace
}  // namespace ricochet::cli
