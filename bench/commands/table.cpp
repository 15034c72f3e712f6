#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "bench/commands.h"
#include "bench/studies/study.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "reports/export.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct TableOptions {
  std::vector<std::string> results, views;
  bool latex = false, tidy = false, pgfplots = false;
  std::string file;
};

bool is_wanted(const TableOptions& options, const std::string& name, bool by_default) {
  return options.views.empty() ? by_default : std::ranges::find(options.views, name) != options.views.end();
}

/// @throws InputError for a view that is none of `known`
void require_views(const TableOptions& options, const std::string& path, const std::vector<std::string>& known) {
  for (const auto& view : options.views) {
    if (std::ranges::find(known, view) == known.end()) throw_unknown_name("view of " + path, view, known);
  }
}

std::string latex_of(const ShownResults& shown, const TableOptions& options) {
  std::vector<std::string> known;
  std::string text;
  for (const auto* table : shown.section.tables()) {
    known.push_back(table->name);
    const bool is_result = table->role == Section::Role::choice || table->role == Section::Role::result;
    if (is_wanted(options, table->name, is_result))
      text += latex(table->table, fmt::format("tab:{}_{}", shown.results.experiment(), table->name)) + "\n";
  }
  require_views(options, shown.results.path, known);
  return text;
}

std::string pgfplots_of(const ShownResults& shown, const TableOptions& options) {
  std::vector<std::string> known;
  std::string text;
  for (const auto& part : shown.section.parts()) {
    const auto* chart = std::get_if<Section::Chart>(&part);
    if (!chart || !has_pgfplots(*chart)) continue;
    known.push_back(chart->name);
    if (is_wanted(options, chart->name, true)) text += pgfplots(*chart) + "\n";
  }
  if (known.empty())
    throw InputError("results", shown.results.path, "results with a chart are required: work over error, profiles");
  require_views(options, shown.results.path, known);
  return pgfplots_document(text);
}

std::string text_of_results(const std::string& path, const TableOptions& options) {
  const ShownResults shown = shown_results(path);
  std::string comments;  // of TeX; CSV has none
  for (const auto& sentence : warnings(shown.results)) {
    comments += fmt::format("% {}\n", sentence);
    fmt::print(stderr, "{}: {}\n", path, sentence);
  }
  if (options.latex) return comments + latex_of(shown, options);
  if (options.pgfplots) return comments + pgfplots_of(shown, options);
  return tidy_csv(shown.results);
}

}  // namespace

void add_table_command(CLI::App& app, int&) {
  static TableOptions options;
  auto* command = app.add_subcommand("table", "results for papers and other programs: LaTeX, tidy CSV, PGFPlots");
  command->add_option("results", options.results, "results files; one, for --tidy")->required();
  auto* tables = command->add_flag("--latex", options.latex, "tables, with booktabs");
  auto* runs = command->add_flag("--tidy", options.tidy, "one line per run, all digits, NaN where there is no number");
  auto* charts = command->add_flag("--pgfplots", options.pgfplots,
                                   "charts with their data: work over error, performance profiles");
  tables->excludes(runs)->excludes(charts);
  runs->excludes(charts);
  command->add_option("--view", options.views, "only this table, or chart; may be repeated")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("-o,--out", options.file, "file; without it the terminal");
  command->footer(
      "Examples:\n"
      "  ricochet table out/results/two_balls_order.jsonl --latex --view orders -o out/orders.tex\n"
      "  ricochet table out/results/two_balls_order.jsonl --tidy -o out/two_balls_order.csv\n"
      "  ricochet table out/results/two_balls_order.jsonl --pgfplots");
  command->callback([] {
    if (!options.latex && !options.tidy && !options.pgfplots)
      throw InputError("table", "no form", "--latex, --tidy or --pgfplots is required");
    if (options.tidy && options.results.size() > 1)
      throw InputError("results", options.results[1], "--tidy takes one results file: others have other columns");
    if (options.tidy && !options.views.empty())
      throw InputError("--view", options.views.front(), "--tidy has every run");
    if (!options.file.empty()) require_writable("table", options.file);
    std::string text;
    for (const auto& path : options.results) text += text_of_results(path, options);
    if (options.file.empty()) {
      fmt::print("{}", text);
      return;
    }
    write_text("table", options.file, text);
    fmt::print("table: {}\n", options.file);
  });
}

}  // namespace ricochet
