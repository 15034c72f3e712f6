#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/commands/show.h"

namespace ricochet {
namespace {

/// Without a line of its own in the help of the program.
CLI::App* add_former(CLI::App& app, const std::string& word) {
  return app.add_subcommand(word, "former word: see run-experiment")->group("");
}

int run_under_its_new_word(const std::string& word, const ExperimentCommand& command) {
  std::string now = "ricochet run-experiment " + command.experiment;
  for (const auto& change : command.run.changes) now += fmt::format(" --set '{}'", change);
  fmt::print(stderr, "ricochet: `{}` is now `{}`\n", word, now);
  return run_and_show(command);
}

/// `order`, `precision` and `compare` of an experiment.
void add_former_experiment(CLI::App& app, int& exit_code, const std::string& word, ExperimentCommand& options) {
  auto* command = add_former(app, word);
  command->add_option("experiment", options.experiment)->required();
  command->add_option("-o,--out", options.run.folder);
  command->add_flag("--quick", options.run.quick);
  command->add_flag("!--no-times", options.run.with_times);
  command->add_option("--time-limit", options.run.time_limit)->check(positive_number());
  command->add_flag("--all", options.print.all);
  command->callback([&exit_code, &options, word] { exit_code = run_under_its_new_word(word, options); });
}

void add_former_cost(CLI::App& app, int& exit_code) {
  static ExperimentCommand options{.experiment = "contact_cost"};
  static std::vector<std::string> methods;
  auto* command = add_former(app, "cost");
  command->add_option("-m,--method", methods);
  command->add_flag("--quick", options.run.quick);
  command->callback([&exit_code] {
    if (!methods.empty()) options.run.changes = {fmt::format("methods=[\"{}\"]", fmt::join(methods, "\",\""))};
    exit_code = run_under_its_new_word("cost", options);
  });
}

void add_former_homotopy(CLI::App& app, int& exit_code) {
  static ExperimentCommand grid{.experiment = "homotopy_grid"};
  static ExperimentCommand sweep{.experiment = "homotopy_sweep"};
  static std::vector<std::string> guesses;
  static std::vector<int> steps;
  auto* former = add_former(app, "homotopy");
  former->require_subcommand(1);
  for (auto* study : {&grid, &sweep}) {
    const std::string word = study == &grid ? "grid" : "sweep";
    auto* command = former->add_subcommand(word, "former word: see run-experiment");
    command->add_option("--guess", guesses)->delimiter(',');
    command->add_option("--steps", steps)->delimiter(',');
    command->callback([&exit_code, study, word] {
      if (!guesses.empty()) study->run.changes.push_back(fmt::format("guess=[\"{}\"]", fmt::join(guesses, "\",\"")));
      if (!steps.empty()) study->run.changes.push_back(fmt::format("steps=[{}]", fmt::join(steps, ",")));
      exit_code = run_under_its_new_word("homotopy " + word, *study);
    });
  }
}

}  // namespace

void add_former_commands(CLI::App& app, int& exit_code) {
  static ExperimentCommand order, precision, compare;
  add_former_experiment(app, exit_code, "order", order);
  add_former_experiment(app, exit_code, "precision", precision);
  add_former_experiment(app, exit_code, "compare", compare);
  add_former_cost(app, exit_code);
  add_former_homotopy(app, exit_code);
}

/// Its page has a folder of its own: that of `ricochet report` shows every experiment.
void add_former_hard_cases_command(CLI::App& report, int& exit_code) {
  static ExperimentCommand options{.experiment = "hard_cases", .page = "out/hard_cases"};
  static std::string hard_case, method;
  auto* command = report.add_subcommand("hard-cases", "former word: see run-experiment")->group("");
  command->add_flag("--quick", options.run.quick);
  command->add_option("--case", hard_case);
  command->add_option("--method,-m", method);
  command->add_flag("--failures", options.print.all);
  command->add_option("--file", options.experiment);
  command->add_option("-o,--out", options.run.folder);
  command->add_option("--page", options.page);
  command->callback([&exit_code] {
    if (!hard_case.empty()) options.run.changes.push_back("only_case=" + hard_case);
    if (!method.empty()) options.run.changes.push_back("only_method=" + method);
    exit_code = run_under_its_new_word("report hard-cases", options);
  });
}

}  // namespace ricochet
