#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands/commands.h"
#include "bench/commands/show.h"
#include "bench/experiment/study.h"
#include "bench/site/history_page.h"
#include "bench/site/report_site.h"
#include "problems/input_error.h"
#include "reports/results_page.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

std::vector<ShownResults> shown_list(const std::vector<std::string>& paths) {
  std::vector<ShownResults> list;
  for (const auto& path : paths) list.push_back(shown_results(path));
  return list;
}

}  // namespace

void add_show_command(CLI::App& app, int&) {
  static std::vector<std::string> results;
  static PrintOptions options;
  auto* command = app.add_subcommand("show", "print the tables of results files");
  command
      ->add_option("results", results,
                   "results files of `ricochet run-experiment` or `ricochet fuzz`, or JSON of Google Benchmark")
      ->required();
  add_print_options(*command, options);
  command->footer("Example:\n  ricochet show out/results/two_balls_order.jsonl --view orders,time_to_reach");
  command->callback([] {
    for (const auto& shown : shown_list(results)) print_results(shown, options);
  });
}

void add_report_command(CLI::App& app, int&) {
  static std::vector<std::string> results;
  static std::string folder = "out/report", history;
  static bool with_pdf = false;
  auto* command = app.add_subcommand("report", "write a site with tables and figures of results files");
  command->add_option("results", results, "results files of `ricochet run-experiment`, or JSON of Google Benchmark");
  command->add_option("-o,--out", folder, "folder to be written")->capture_default_str();
  command->add_flag("--pdf", with_pdf, "also write the figures as PDF");
  command->add_option("--history", history, "FOLDER of ./run history: add the history to the site");
  command->footer("Example:\n  ricochet report out/results/two_balls_order.jsonl -o out/report --pdf");
  command->callback([] {
    if (results.empty()) throw InputError("results", "''", "results files are required");
    require_writable_folder("folder of the site", folder);
    const auto more = history_pages(history);  // a damaged one before the site is written
    const auto list = shown_list(results);
    fmt::print("report: {}\n", write_report_site(list, folder, more, with_pdf));
  });
}

void add_results_command(CLI::App& app, int&) {
  static std::vector<std::string> results;
  static std::string page = "RESULTS.md", tables = "results";
  auto* command = app.add_subcommand("results", "write a Markdown page with the tables of results files");
  command->add_option("results", results, "results files, in the order of the sections")->required();
  command->add_option("-o,--out", page, "page to be written")->capture_default_str();
  command->add_option("--tables", tables, "folder for the complete tables as CSV")->capture_default_str();
  command->footer(
      "Example:\n  ricochet results out/results/two_balls_order.jsonl -o out/RESULTS.md --tables out/tables");
  command->callback([] {
    require_writable("results page", page);
    require_writable_folder("folder of the tables", tables);
    write_results_page(shown_list(results), page, tables);
    fmt::print("results page: {}\n", page);
  });
}

}  // namespace ricochet
