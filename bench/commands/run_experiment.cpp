#include "bench/run_experiment.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "bench/commands.h"
#include "bench/experiment_file.h"
#include "bench/show.h"
#include "bench/studies/study.h"
#include "problems/input_error.h"
#include "reports/page.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

/// Results of the names of "also_shown" that are there.
std::vector<std::string> also_shown(const ExperimentFile& experiment, const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& name : experiment.document.value("also_shown", std::vector<std::string>())) {
    const fs::path path = fs::path(folder) / (name + ".jsonl");
    if (fs::exists(path)) paths.push_back(path);
  }
  return paths;
}

}  // namespace

int run_and_show(const ExperimentCommand& command) {
  const ExperimentFile experiment = read_experiment_file(command.experiment);
  const auto parts = experiment.parts();
  if (parts.size() > 1 && !command.run.changes.empty())
    throw InputError("--set", command.run.changes.front(), "an experiment without parts is required");
  std::vector<std::string> paths;
  int failed = 0;
  for (const auto& part : parts) {
    paths.push_back(run_experiment(part, command.run));
    const ShownResults shown = shown_results(paths.back());
    print_results(shown, command.print);
    const int here = surprises(shown.results);
    if (here > 0) fmt::print("{} rows failed that the experiment does not expect to fail\n\n", here);
    failed += here;
  }
  if (!command.page.empty()) {
    const auto more = also_shown(experiment, command.run.folder);
    paths.insert(paths.end(), more.begin(), more.end());
    std::vector<ShownResults> list;
    for (const auto& path : paths) list.push_back(shown_results(path));
    fmt::print("page: {}\n", write_page(list, command.page));
  }
  return failed > 0 ? 1 : 0;
}

void add_run_experiment_command(CLI::App& app, int& exit_code) {
  static ExperimentCommand options;
  static bool without_times = false;
  auto* command = app.add_subcommand(
      "run-experiment",
      "run an experiment where its results are missing, and print them; exit code 1 when a row fails that the "
      "experiment does not expect to fail");
  command->add_option("experiment", options.experiment, "name, see `ricochet list experiments`, or a file")->required();
  command->add_option("-o,--out", options.run.folder, "folder for the results file")->capture_default_str();
  command->add_flag("--quick", options.run.quick, "the short part of the experiment; times are measured three times");
  command->add_flag("--no-times", without_times, "do not measure times where they are not what is asked for");
  command->add_flag("--force", options.run.force, "compute again what is there already; it is kept under a dated name");
  command->add_option("--time-limit", options.run.time_limit, "wall time per run in seconds")
      ->check(CLI::PositiveNumber);
  command->add_option("--set", options.run.changes,
                      "FIELD=VALUE, a field of the experiment, in JSON or as text; the results are then those of "
                      "ID_part");
  command->add_option("--page", options.page, "FOLDER of a page of the results");
  add_print_options(*command, options.print);
  command->footer(
      "Examples:\n"
      "  ricochet run-experiment two_balls_order --quick\n"
      "  ricochet run-experiment zeno --page out/report\n"
      "  ricochet run-experiment hard_cases --set only_case=wedge --set only_method=moreau_jean --view failures");
  command->callback([&exit_code] {
    options.run.with_times = !without_times;
    exit_code = run_and_show(options);
  });
}

}  // namespace ricochet
