#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>

#include "bench/commands.h"
#include "bench/environment.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace {

/// CLI11 says only that a subcommand is required. @throws InputError with near matches
void check_subcommand(const CLI::App& app, const std::string& word) {
  if (word.starts_with('-')) return;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->check_name(word)) return;
    names.push_back(command->get_name());
  }
  ricochet::throw_unknown_name("subcommand", word, names);
}

/// What was printed is there, or the run has failed: a full disk, a reader that is gone.
int flushed(int exit_code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return exit_code;
  fmt::print(stderr, "ricochet: standard output cannot be written\n");
  return std::max(exit_code, 1);
}

}  // namespace

/// The program `ricochet`. Exit codes: 0 all went well, 1 a run or a check failed, 2 bad usage or bad input.
int main(int argc, char** argv) {
  CLI::App app{"Ricochet: methods for rigid-body motion with impacts, their accuracy and their speed"};
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  ricochet run --problem two_balls_spring --method fesd:gauss:4 --steps 200\n"
      "  ricochet run-experiment two_balls_order\n"
      "  ricochet report out/results/two_balls_order.jsonl -o out/report\n"
      "Exit codes: 0 all went well; 1 a run failed, or a check does not hold; 2 bad usage or bad input");
  app.set_version_flag("--version", ricochet::version_text(), "the version and revision of the program");
  int exit_code = 0;
  for (const auto add : {ricochet::add_list_command, ricochet::add_run_command, ricochet::add_audit_command,
                         ricochet::add_ensemble_command, ricochet::add_export_command, ricochet::add_contacts_command,
                         ricochet::add_control_command, ricochet::add_mpc_command, ricochet::add_run_experiment_command,
                         ricochet::add_show_command, ricochet::add_report_command, ricochet::add_results_command,
                         ricochet::add_check_command, ricochet::add_fuzz_command, ricochet::add_schema_command,
                         ricochet::add_former_commands}) {
    add(app, exit_code);
  }
  try {
    if (argc > 1) check_subcommand(app, argv[1]);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return flushed(app.exit(error) == 0 ? 0 : 2);
  } catch (const ricochet::InputError& error) {
    fmt::print(stderr, "ricochet: {}\n", error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "ricochet: not enough memory for a problem of this size\n");
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "ricochet: {}\n", error.what());
    return 1;
  }
  return flushed(exit_code);
}
