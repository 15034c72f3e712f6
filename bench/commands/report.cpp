#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "problems/input_error.h"
#include "reports/baseline.h"
#include "reports/page.h"

namespace ricochet {

void add_report_command(CLI::App& app, int& exit_code) {
  static std::vector<std::string> results;
  static std::string folder = "out/report";
  auto* command = app.add_subcommand("report", "the page: tables and figures of results files");
  command->add_option("results", results,
                      "results files, of `ricochet order`, `ricochet precision` or `ricochet compare`");
  command->add_option("-o,--out", folder, "folder of the page")->capture_default_str();
  add_hard_cases_command(*command, exit_code);
  command->callback([command] {
    if (!command->get_subcommands().empty()) return;
    if (results.empty()) throw InputError("results", "''", "results files, or the subcommand hard-cases, are required");
    fmt::print("report: {}\n", write_report(results, folder));
  });
}

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
    if (!new_baseline.empty()) {
      write_baseline(results, new_baseline);
      fmt::print("baseline: {}\n", new_baseline);
      return;
    }
    if (baseline.empty())
      throw InputError("--baseline", "''", "a baseline file, or --write with a new one, is required");
    const BaselineCheck check = check_baseline(results, baseline);
    for (const auto& line : check.improvements) fmt::print("better:     {}\n", line);
    for (const auto& line : check.regressions) fmt::print("regression: {}\n", line);
    fmt::print("{} lines compared with {}: {} regressions, {} improvements\n", check.compared, baseline,
               check.regressions.size(), check.improvements.size());
    if (!check.regressions.empty()) exit_code = 1;
  });
}

}  // namespace ricochet
