#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "bench/commands/commands.h"
#include "bench/experiment/study.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "reports/export.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct TableOptions {
  std::vector<std::string> results, views;
  bool latex = false, tidy = false, pgfplots = false;
  std::string columns;
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
  std::vector<std::string> known, headers;
  std::vector<const Section::NamedTable*> tables;
  for (const auto* table : shown.section.tables()) {
    known.push_back(table->name);
    const bool is_result = table->role == Section::Role::choice || table->role == Section::Role::result;
    if (!is_wanted(options, table->name, is_result) || table->table.rows.empty()) continue;
    tables.push_back(table);
    for (const auto& column : table->table.columns) {
      if (std::ranges::find(headers, column.header) == headers.end()) headers.push_back(column.header);
    }
  }
  require_views(options, shown.results.path, known);
  std::string text;
  const auto names = options.columns.empty() ? headers : headers_in(options.columns, headers);
  for (const auto* table : tables) {
    const Table chosen = options.columns.empty() ? table->table : with_columns(table->table, names);
    if (!chosen.columns.empty())
      text += latex(chosen, fmt::format("tab:{}_{}", shown.results.experiment(), table->name)) + "\n";
  }
  return text;
}

/// Beside a file the numbers are in files of their own, fig.dat of fig.tex, or fig_work_precision.dat of one chart of
/// several.
std::string stem_of(const ShownResults& shown, const TableOptions& options, const std::string& chart, bool is_only) {
  std::string stem = std::filesystem::path(options.file).stem().string();
  if (options.results.size() > 1) stem += "_" + shown.results.experiment();
  return is_only ? stem : stem + "_" + chart;
}

std::string pgfplots_of(const ShownResults& shown, const TableOptions& options) {
  std::vector<const Chart*> wanted;
  std::vector<PgfplotsData> data;
  std::vector<std::string> known;
  std::string text;
  for (const auto& part : shown.section.parts()) {
    const auto* shown_chart = std::get_if<Section::ShownChart>(&part);
    if (!shown_chart || !has_pgfplots(shown_chart->chart)) continue;
    const Chart& chart = shown_chart->chart;
    known.push_back(chart.name);
    if (is_wanted(options, chart.name, true)) wanted.push_back(&chart);
  }
  const bool is_only = wanted.size() == 1 && options.results.size() == 1, is_file = !options.file.empty();
  for (const auto* chart : wanted)
    text += pgfplots(*chart, is_file ? &data : nullptr, stem_of(shown, options, chart->name, is_only)) + "\n";
  if (known.empty()) throw InputError("results", shown.results.path, "results with a chart are required");
  require_views(options, shown.results.path, known);
  for (const auto& numbers : data)
    write_text("table", std::filesystem::path(options.file).parent_path() / numbers.file, numbers.text);
  return text;
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
  auto* command = app.add_subcommand("table", "write results for papers and other programs: LaTeX, tidy CSV, PGFPlots");
  command->add_option("results", options.results, "results files; --tidy takes one")->required();
  auto* tables = command->add_flag("--latex", options.latex, "write tables with booktabs");
  auto* runs = command->add_flag("--tidy", options.tidy,
                                 "write CSV with one line per run, all digits, and NaN for missing numbers");
  auto* charts = command->add_flag("--pgfplots", options.pgfplots,
                                   "write charts; with -o FILE the numbers are in .dat files beside it");
  tables->excludes(runs)->excludes(charts);
  runs->excludes(charts);
  command->add_option("--view", options.views, "write only this table or chart; may be repeated")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--columns", options.columns,
                      "with --latex: only these columns, in this order, as comma-separated headers");
  command->add_option("-o,--out", options.file, "file to be written (default: standard output)");
  command->footer(
      "Examples:\n"
      "  ricochet table out/results/two_balls_order.jsonl --latex --view orders -o out/orders.tex\n"
      "  ricochet table out/results/two_balls_order.jsonl --latex --view orders --columns \"method,nominal,fitted slope\"\n"
      "  ricochet table out/results/two_balls_order.jsonl --tidy -o out/two_balls_order.csv\n"
      "  ricochet table out/results/two_balls_order.jsonl --pgfplots -o out/figure.tex");
  command->callback([] {
    if (!options.latex && !options.tidy && !options.pgfplots)
      throw InputError("--latex, --tidy or --pgfplots is required");
    if (options.tidy && options.results.size() > 1)
      throw InputError("results", options.results[1], "--tidy takes one results file: others have other columns");
    if (options.tidy && !options.views.empty())
      throw InputError("--view", options.views.front(), "--tidy always writes every run");
    if (!options.columns.empty() && !options.latex)
      throw InputError("--columns", options.columns, "--latex is required, which writes tables");
    if (!options.file.empty()) require_writable("table", options.file);
    std::string text;
    for (const auto& path : options.results) text += text_of_results(path, options);
    if (options.pgfplots) text = pgfplots_document(text);
    if (options.file.empty()) {
      fmt::print("{}", text);
      return;
    }
    write_text("table", options.file, text);
    fmt::print("table: {}\n", options.file);
  });
}

}  // namespace ricochet
