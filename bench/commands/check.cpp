#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "bench/commands.h"
#include "bench/studies/method_grid/baseline.h"
#include "bench/studies/method_grid/gate_output.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

struct CheckOptions {
  std::vector<std::string> results;
  std::string baseline, baselines;     ///< a file; a folder of ID.jsonl
  std::string new_baseline, replaced;  ///< the same, to be written
  std::string junit, summary;          ///< files
  bool as_json = false, for_github = false;
};

std::vector<GridResults> read_all(const std::vector<std::string>& paths) {
  std::vector<GridResults> list;
  std::set<std::string> experiments;
  for (const auto& path : paths) {
    list.push_back(read_gated_results(path));
    if (!experiments.insert(list.back().id).second)
      throw InputError("results file", path, fmt::format("another one is of {}, too", list.back().id));
  }
  return list;
}

std::string file_in(const std::string& folder, const GridResults& results) {
  return (fs::path(folder) / (results.id + ".jsonl")).string();
}

void write_baselines(const std::vector<GridResults>& list, const CheckOptions& options) {
  if (!options.new_baseline.empty() && list.size() > 1)
    throw InputError("--write", options.new_baseline, "one results file is required; --replace FOLDER takes several");
  for (const auto& results : list) {
    const std::string path = options.replaced.empty() ? options.new_baseline : file_in(options.replaced, results);
    const std::string former = path + ".former";
    if (!options.replaced.empty()) fs::create_directories(options.replaced);
    const bool replaces = !options.replaced.empty() && fs::exists(path);
    if (replaces) fs::rename(path, former);
    try {
      write_baseline(results, path);
    } catch (...) {
      if (replaces) fs::rename(former, path);
      throw;
    }
    if (replaces) fs::remove(former);
    fmt::print("baseline: {}\n", path);
  }
}

/// Appends, as a step of a workflow has to that others share the file with.
void append(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::app);
  file << text;
  if (!file.flush()) throw InputError("summary file", path, "it cannot be written");
}

void replace(const std::string& path, const std::string& text) {
  if (fs::is_regular_file(path)) fs::remove(path);
  write_text(path, text);
}

int check(const std::vector<GridResults>& list, const CheckOptions& options) {
  if (!options.baseline.empty() && list.size() > 1)
    throw InputError("--baseline", options.baseline, "one results file is required; --baselines FOLDER takes several");
  std::vector<GateReport> reports;
  for (const auto& results : list) {
    const std::string path = options.baseline.empty() ? file_in(options.baselines, results) : options.baseline;
    reports.push_back(hold_against(read_baseline(path), results));
  }
  if (!options.junit.empty()) replace(options.junit, gate_junit(reports));
  if (!options.summary.empty()) replace(options.summary, gate_markdown(reports));
  if (const char* file = std::getenv("GITHUB_STEP_SUMMARY"); options.for_github && file && *file)
    append(file, gate_markdown(reports));
  if (options.as_json) {
    fmt::print("{}\n", gate_json(reports).dump(1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    for (const auto& report : reports) fmt::print("{}", gate_text(report));
  }
  if (options.for_github) fmt::print("{}", gate_annotations(reports));
  return std::ranges::all_of(reports, &GateReport::holds) ? 0 : 1;
}

}  // namespace

void add_check_command(CLI::App& app, int& exit_code) {
  static CheckOptions options;
  auto* command = app.add_subcommand(
      "check", "hold results against a stored baseline; exit code 1 when one got worse or was not compared");
  command->add_option("results", options.results, "results files of methods on a grid")->required();
  auto* where = command->add_option_group("baseline", "what they are held against, or what is written");
  where->add_option("--baseline", options.baseline, "baseline FILE, or other results");
  where->add_option("--baselines", options.baselines, "FOLDER of baselines, EXPERIMENT.jsonl");
  where->add_option("--write", options.new_baseline, "write what the results hold to a new baseline FILE");
  where->add_option("--replace", options.replaced, "write FOLDER/EXPERIMENT.jsonl in place of what is there");
  where->require_option(1);
  auto* as_json = command->add_flag("--json", options.as_json, "print JSON");
  command
      ->add_flag("--github", options.for_github, "annotations of GitHub Actions, and a summary in $GITHUB_STEP_SUMMARY")
      ->excludes(as_json);
  command->add_option("--junit", options.junit, "write JUnit XML to FILE");
  command->add_option("--summary", options.summary, "write a summary in Markdown to FILE");
  command->footer(
      "Examples:\n"
      "  ricochet check out/mine/two_balls_order.jsonl --baseline reports/baselines/two_balls_order.jsonl\n"
      "  ricochet check out/mine/two_balls_order.jsonl --baselines reports/baselines --junit out/gate.xml --json\n"
      "  ricochet check out/mine/two_balls_order.jsonl --write out/mine_baseline.jsonl");
  command->callback([&exit_code] {
    const auto list = read_all(options.results);
    if (!options.new_baseline.empty() || !options.replaced.empty())
      write_baselines(list, options);
    else
      exit_code = check(list, options);
  });
}

}  // namespace ricochet
