#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/run_experiment.h"
#include "problems/input_error.h"
#include "reports/tables.h"

namespace ricochet {
namespace {

struct ExperimentArguments {
  std::string experiment;
  RunOptions run;
  bool without_times = false;
  bool all = false;
};

void add_options(CLI::App& command, ExperimentArguments& options) {
  command.add_option("experiment", options.experiment, "name, see `ricochet list experiments`, or a file")->required();
  command.add_option("-o,--out", options.run.folder, "folder for the results file")->capture_default_str();
  command.add_flag("--quick", options.run.quick, "leave out runs above 20000 steps, measure times three times only");
  command.add_option("--time-limit", options.run.time_limit, "wall time per run in seconds")->capture_default_str();
  command.add_flag("--all", options.all, "print every run");
}

/// Runs the experiment, or each part of it, and shows its results.
template <class Show>
void run_and_show(ExperimentArguments& options, const std::string& command, const Show& show) {
  for (const auto& part : outline_of(options.experiment).parts) {
    options.run.command_line = fmt::format("ricochet {} {}{}", command, part, options.run.quick ? " --quick" : "");
    const std::string path = run_experiment(read_experiment(part), options.run);
    const Results results = read_results(path);
    fmt::print("{}\nresults: {}\n\n", results.header.value("title", part), path);
    show(results);
  }
}

}  // namespace

void add_order_command(CLI::App& app, int&) {
  static ExperimentArguments options;
  auto* command = app.add_subcommand("order", "run an experiment and print its orders of convergence");
  add_options(*command, options);
  command->add_flag("--no-times", options.without_times, "do not measure times");
  command->callback([] {
    options.run.with_times = !options.without_times;
    run_and_show(options, "order", [](const Results& results) {
      fmt::print("{}\n", order_summary(results).text());
      const Table failed = failures(results);
      if (!failed.rows.empty()) fmt::print("{}\n", failed.list());
      if (options.all) fmt::print("{}\n", order_details(results).text());
    });
  });
}

void add_precision_command(CLI::App& app, int&) {
  static ExperimentArguments options;
  auto* command = app.add_subcommand("precision", "run an experiment and print its speed against its error");
  add_options(*command, options);
  command->callback([] {
    run_and_show(options, "precision", [](const Results& results) {
      if (results.header.contains("overhead_of")) fmt::print("{}\n", overhead(results).text());
      if (results.has_errors()) fmt::print("{}\n", time_to_reach(results).text());
      const Table failed = failures(results);
      if (!failed.rows.empty()) fmt::print("{}\n", failed.list());
      if (options.all) fmt::print("{}\n", precision_details(results).text());
    });
  });
}

}  // namespace ricochet
