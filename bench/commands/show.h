#pragma once

#include <string>
#include <vector>

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

/// Prints a line: title, number of rows, number of runs without a result, file.
void print_summary(const ShownResults& shown);

}  // namespace ricochet
