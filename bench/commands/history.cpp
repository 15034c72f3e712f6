#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <string>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "bench/site/history_page.h"
#include "problems/input_error.h"
#include "reports/site/site.h"
#include "reports/text_file.h"

extern char** environ;

namespace ricochet {
namespace {

constexpr int kNoHistory = 77;  // the exit code of bench/tools/history/make_history where git has none

/// Runs bench/tools/history/make_history, which reads git, with this program for the orders. @return its exit code
int make_history(const std::string& folder, int commits) {
  std::string script = find_project_file("bench/tools/history/make_history"), number = std::to_string(commits),
              to = folder, python = "python3", option = "--program",
              program = std::filesystem::read_symlink("/proc/self/exe").string();
  std::array<char*, 7> words = {python.data(), script.data(),  to.data(), number.data(),
                                option.data(), program.data(), nullptr};
  pid_t child = 0;
  if (posix_spawnp(&child, python.c_str(), nullptr, nullptr, words.data(), environ) != 0)
    throw InputError("history", python, "cannot be run; Python 3 is required");
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

void add_history_command(CLI::App& app, int& exit_code) {
  static std::string folder = "out/history";
  static int commits = 20;
  auto* command = app.add_subcommand(
      "history", "show how counters, errors, orders and verdicts of the baselines changed with each commit");
  command->add_option("commits", commits, "number of commits that changed a baseline (default: 20)")
      ->check(positive_number());
  command->add_option("-o,--out", folder, "folder of a page and a JSON file per commit (default: out/history)");
  command->footer(
      "Requires a git checkout with reports/baselines/.\nExamples:\n  ricochet history\n  ricochet history 50 -o "
      "out/history\n"
      "  ricochet report out/results/two_balls_order.jsonl --history out/history -o out/report");
  command->callback([&exit_code] {
    require_writable_folder("history", folder);
    exit_code = make_history(folder, commits);
    if (exit_code == kNoHistory)
      throw InputError("history", std::filesystem::current_path().string(),
                       "a git checkout with commits that changed reports/baselines/ is required");
    if (exit_code == 0) {
      write_site({}, {SiteGroup{"", history_pages(folder)}}, folder);
      fmt::print("history: {}/history.html\n", folder);
    }
  });
}

}  // namespace ricochet
