#include "bench/commands/program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string_view>

#include "bench/commands/commands.h"
#include "bench/measure/environment.h"
#include "bench/plugin/load_plugins.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

/// The innermost command that was parsed.
const CLI::App& parsed_command(const CLI::App& app) {
  const auto parsed = app.get_subcommands();
  return parsed.empty() ? app : parsed_command(*parsed.back());
}

/// "ricochet contacts solve"
std::string words_of(const CLI::App& command) {
  return command.get_parent() ? words_of(*command.get_parent()) + " " + command.get_name() : "ricochet";
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_name().empty()) names.push_back(command->get_name());
  }
  return names;
}

/// Names of the options of a command: "--steps", "-N".
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const auto& name : option->get_lnames()) names.push_back("--" + name);
    for (const auto& name : option->get_snames()) names.push_back("-" + name);
  }
  for (const CLI::App* group : command.get_subcommands({})) {
    if (!group->get_name().empty()) continue;
    for (auto& name : option_names(*group)) names.push_back(std::move(name));
  }
  return names;
}

/// CLI11 says of a word that it does not know only that it is there, and nothing of it where something else is missing.
/// @throws InputError with near matches
void refuse_unknown_words(const CLI::App& command) {
  for (const auto& word : command.remaining()) {
    if (word == "--") continue;
    if (word.starts_with('-'))
      throw_unknown_name("option of " + words_of(command), word.substr(0, word.find('=')), option_names(command));
    if (const auto commands = command_names(command); !commands.empty())
      throw_unknown_name("command of " + words_of(command), word, commands);
    throw InputError(words_of(command), "'" + word + "'", "unexpected argument");
  }
}

/// CLI11 takes an empty word for zero where a number is expected, and for text that was not given. A shell makes one of a
/// variable that is not set. @throws InputError
void refuse_empty_words(int argc, char** argv) {
  for (int k = 1; k < argc; ++k) {
    const std::string_view word = argv[k];
    const bool is_cut = word.starts_with("--") && word.find('=') == word.size() - 1;
    if (word.empty() || is_cut) throw InputError(is_cut ? word : argv[k - 1], "''", "a value is required");
  }
}

/// @return the exit code
int refuse(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = parsed_command(app);
  if (error.get_exit_code() == 0) {  // --help, of a command that exists
    const auto words = command.remaining();
    if (!words.empty() && !words.front().starts_with('-') && !command_names(command).empty())
      refuse_unknown_words(command);
    return app.exit(error);
  }
  refuse_unknown_words(command);
  fmt::print(stderr, "ricochet: {}; see `{} --help`\n", error.what(), words_of(command));
  return 2;
}

/// Exit code after flushing the output: a failure if the text could not be written (full disk, closed pipe).
int flushed(int exit_code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return exit_code;
  fmt::print(stderr, "ricochet: standard output cannot be written\n");
  return std::max(exit_code, 1);
}

int parse(CLI::App& app, int argc, char** argv, const int& exit_code) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return refuse(app, error);
  }
  return exit_code;
}

}  // namespace

void add_commands(CLI::App& app, int& exit_code) {
  app.require_subcommand(1);
  for (const auto add : {add_list_command,           add_run_command,      add_audit_command,   add_ensemble_command,
                         add_export_command,         add_contacts_command, add_control_command, add_mpc_command,
                         add_run_experiment_command, add_show_command,     add_report_command,  add_results_command,
                         add_table_command,          add_check_command,    add_history_command, add_verify_command,
                         add_check_gradient_command, add_fuzz_command,     add_schema_command,  add_truth_command}) {
    add(app, exit_code);
  }
}

int run_program(int argc, char** argv) {
  CLI::App app{"Ricochet: accuracy and speed of numerical methods for rigid bodies with impacts and friction"};
  app.footer(
      "Examples:\n"
      "  ricochet run --problem two_balls_spring --method fesd:gauss:4 --steps 200\n"
      "  ricochet run-experiment two_balls_order\n"
      "  ricochet report out/results/two_balls_order.jsonl -o out/report\n"
      "Exit codes: 0 all went well; 1 a run or a check failed; 2 bad usage or bad input");
  std::vector<std::string> plugins;  // load_plugins() has taken them out before
  app.add_option("--plugin", plugins,
                 "load FILE, a shared library with your methods or scenes; may be repeated and stand anywhere");
  app.set_version_flag("--version", version_text(), "print the version and revision of the program");
  int exit_code = 0;
  add_commands(app, exit_code);
  try {
    refuse_empty_words(argc, argv);
    std::vector<std::string> words(argv, argv + argc);
    load_plugins(words);
    std::vector<char*> rest;
    for (auto& word : words) rest.push_back(word.data());
    return flushed(parse(app, static_cast<int>(rest.size()), rest.data(), exit_code));
  } catch (const InputError& error) {
    fmt::print(stderr, "ricochet: {}\n", error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "ricochet: not enough memory for a problem of this size\n");
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "ricochet: {}\n", error.what());
    return 1;
  }
}

}  // namespace ricochet
