#pragma once

#include <string>
#include <vector>

#include "bench/commands/ad_hoc_experiment.h"
#include "bench/experiment/run_experiment.h"
#include "reports/section.h"

namespace CLI {
class App;
}

namespace ricochet {

/// The part of results that is printed.
struct PrintOptions {
  std::vector<std::string> views;  ///< names of tables; empty: all tables without those of every run
  bool all = false;
};

/// Adds --view and --all.
void add_print_options(CLI::App& command, PrintOptions& options);

/// Prints title, file and tables. @throws InputError for a view that the results do not have
void print_results(const ShownResults& shown, const PrintOptions& options);

/// `ricochet run-experiment`, with the words before it that still stand for it.
struct ExperimentCommand {
  std::string experiment;  ///< empty: the ad-hoc one
  AdHocStudy ad_hoc = {};
  RunOptions run = {};
  PrintOptions print = {};
  std::string page = {};           ///< folder; empty: none
  std::string history = {};        ///< folder of ./run history, for the site of the page; empty: none
  bool prints_experiment = false;  ///< prints the experiment instead of running it
};

/// Runs the experiment, or each of its parts, and prints the results. @return the exit code
int run_and_show(const ExperimentCommand& command);

}  // namespace ricochet
