#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/studies/run_hard_cases.h"
#include "reports/page.h"
#include "reports/record.h"

namespace ricochet {
namespace {

struct HardCaseArguments {
  std::string file = "hard_cases", hard_case, method;
  std::string folder = "out/results", page = "out/report";
  bool quick = false, failures = false;
};

HardCases chosen(const HardCaseArguments& options) {
  const HardCases all = read_hard_cases(options.file);
  return (options.quick ? all.quick() : all).only(options.hard_case, options.method);
}

std::string hard_case_command_line(const HardCaseArguments& options) {
  std::string text = "ricochet report hard-cases";
  if (options.quick) text += " --quick";
  if (!options.hard_case.empty()) text += " --case " + options.hard_case;
  if (!options.method.empty()) text += " --method " + options.method;
  return text;
}

/// @return whether no method crashed, had to be killed, or called a number that is not finite a success
bool show(const std::vector<HardCell>& cells, bool failures) {
  for (const auto& table : verdict_tables(cells)) fmt::print("{}\n", table.text());
  fmt::print("{}\n{}\n", verdict_legend(cells).text(), case_table(cells).text());
  if (const Table drift = energy_table(cells); !drift.rows.empty()) fmt::print("{}\n", drift.text());
  if (failures) fmt::print("{}\n", hard_failures(cells).list());
  bool is_bounded = true;
  for (const auto& cell : cells) {
    const CaseVerdict verdict = cell.verdict();
    if (verdict == CaseVerdict::crashed || verdict == CaseVerdict::killed || verdict == CaseVerdict::not_finite)
      is_bounded = false;
  }
  return is_bounded;
}

}  // namespace

void add_hard_cases_command(CLI::App& report, int& exit_code) {
  static HardCaseArguments options;
  auto* command = report.add_subcommand(
      "hard-cases",
      "run every method on every hard case, where it is missing, and print the matrix of verdicts; exit code 1 when a "
      "method hangs, crashes or calls NaN a success");
  command->add_flag("--quick", options.quick, "the small subset of the file");
  command->add_option("--case", options.hard_case, "one case only");
  command->add_option("--method,-m", options.method, "one method only, also one that is not in the matrix");
  command->add_flag("--failures", options.failures,
                    "list every cell that is not right, with the command that repeats it");
  command->add_option("--file", options.file, "file of the cases, or its name in bench/experiments/")
      ->capture_default_str();
  command->add_option("-o,--out", options.folder, "folder for the results file")->capture_default_str();
  command->add_option("--page", options.page, "folder of the page")->capture_default_str();
  command->callback([&exit_code] {
    const std::string path = run_hard_cases(chosen(options), {options.folder, hard_case_command_line(options)});
    const Results results = read_results(path);
    fmt::print("{}\n\n", results.header.value("title", ""));
    if (!show(results.hard_cells, options.failures)) exit_code = 1;
    fmt::print("results: {}\npage:    {}\n", path, write_report({path}, options.page));
  });
}

}  // namespace ricochet
