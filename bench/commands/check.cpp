#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/studies/method_grid/baseline.h"
#include "problems/input_error.h"

namespace ricochet {

void add_check_command(CLI::App& app, int& exit_code) {
  static std::string results_path, baseline, new_baseline;
  auto* command = app.add_subcommand("check", "hold results against a stored baseline; exit code 1 on a regression");
  command->add_option("results", results_path, "results file")->required();
  auto* compare = command->add_option("--baseline", baseline, "baseline file to compare with");
  command->add_option("--write", new_baseline, "write the orders and accuracies of the results to a new baseline file")
      ->excludes(compare);
  command->callback([&exit_code] {
    const Results results = read_results(results_path);
    if (!results.is_complete) throw InputError("results file", results_path, "it is not complete");
    const GridResults grid(results);
    if (!new_baseline.empty()) {
      write_baseline(grid, new_baseline);
      fmt::print("baseline: {}\n", new_baseline);
      return;
    }
    if (baseline.empty())
      throw InputError("--baseline", "''", "a baseline file, or --write with a new one, is required");
    const BaselineCheck check = check_baseline(grid, baseline);
    for (const auto& line : check.improvements) fmt::print("better:     {}\n", line);
    for (const auto& line : check.regressions) fmt::print("regression: {}\n", line);
    fmt::print("{} lines compared with {}: {} regressions, {} improvements\n", check.compared, baseline,
               check.regressions.size(), check.improvements.size());
    if (!check.regressions.empty()) exit_code = 1;
  });
}

}  // namespace ricochet
