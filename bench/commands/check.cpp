#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <variant>

#include "bench/commands/commands.h"
#include "bench/experiment/study.h"
#include "bench/gate/baseline.h"
#include "bench/gate/counter_gate.h"
#include "bench/gate/gate_output.h"
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

/// Input of a gate: errors and work of methods on a grid, or counters of benchmarks.
using Gated = std::variant<GridResults, CounterResults>;

Gated read_gated(const std::string& path) {
  const Results results = read_any_results(path);
  if (study_of(results).kind == kBenchmarkStudy) return CounterResults(results);
  return gated_results(results);
}

std::string id_of(const Gated& results) {
  return std::visit([](const auto& some) { return some.id; }, results);
}

GateReport hold_against_file(const std::string& baseline, const Gated& results) {
  if (const auto* counters = std::get_if<CounterResults>(&results))
    return hold_against(read_counter_baseline(baseline), *counters);
  return hold_against(read_baseline(baseline), std::get<GridResults>(results));
}

void write_gated(const Gated& results, const std::string& path) {
  std::visit([&](const auto& some) { write_baseline(some, path); }, results);
}

std::vector<Gated> read_all(const std::vector<std::string>& paths) {
  std::vector<Gated> list;
  std::set<std::string> experiments;
  for (const auto& path : paths) {
    list.push_back(read_gated(path));
    if (const std::string id = id_of(list.back()); !experiments.insert(id).second)
      throw InputError("results file", path, fmt::format("another file also contains {}", id));
  }
  return list;
}

std::string file_in(const std::string& folder, const Gated& results) {
  return (fs::path(folder) / (id_of(results) + ".jsonl")).string();
}

/// A baseline takes the place of a former one when it is written whole.
void replace_baseline(const Gated& results, const std::string& folder) {
  const std::string path = file_in(folder, results), made = path + ".new";
  std::error_code error;
  fs::create_directories(folder, error);
  fs::remove(made, error);
  write_gated(results, made);
  fs::rename(made, path, error);
  if (!error) return;
  fs::remove(made);
  throw InputError("baseline file", path, "it cannot be replaced");
}

void write_baselines(const std::vector<Gated>& list, const CheckOptions& options) {
  if (!options.new_baseline.empty() && list.size() > 1)
    throw InputError("--write", options.new_baseline, "one results file is required; --replace FOLDER takes several");
  for (const auto& results : list) {
    if (options.replaced.empty())
      write_gated(results, options.new_baseline);
    else
      replace_baseline(results, options.replaced);
    fmt::print("baseline: {}\n", options.replaced.empty() ? options.new_baseline : file_in(options.replaced, results));
  }
}

/// Appends, as a step of a workflow has to that others share the file with.
void append(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::app);
  file << text;
  if (!file.flush()) throw InputError("summary file", path, "it cannot be written");
}

/// Files that the check may read.
std::vector<std::string> files_read(const CheckOptions& options) {
  std::vector<std::string> paths = options.results;
  if (!options.baseline.empty()) paths.push_back(options.baseline);
  std::error_code error;
  if (!options.baselines.empty()) {
    for (const auto& entry : fs::directory_iterator(options.baselines, error)) paths.push_back(entry.path());
  }
  return paths;
}

/// Removes what an earlier check has written: a check that finds nothing out leaves no file that says it held.
/// @throws InputError where the file is one that is read
void make_room(const std::string& path, const std::string& option, const std::vector<std::string>& read) {
  std::error_code error;
  if (fs::is_directory(path, error)) throw InputError(option, path, "it is a folder");
  if (path.empty() || !fs::is_regular_file(path, error)) return;
  for (const auto& other : read) {
    if (fs::equivalent(path, other, error)) throw InputError(option, path, "the file is also an input");
  }
  if (!fs::remove(path, error)) throw InputError(option, path, "it cannot be written");
}

int check(const CheckOptions& options) {
  if (!options.baseline.empty() && options.results.size() > 1)
    throw InputError("--baseline", options.baseline, "one results file is required; --baselines FOLDER takes several");
  const auto read = files_read(options);
  make_room(options.junit, "--junit", read);
  make_room(options.summary, "--summary", read);
  if (!options.junit.empty()) require_writable_there("JUnit file", options.junit);
  if (!options.summary.empty()) require_writable_there("summary file", options.summary);
  const auto list = read_all(options.results);
  std::vector<std::string> baselines;
  for (const auto& results : list)
    baselines.push_back(options.baseline.empty() ? file_in(options.baselines, results) : options.baseline);
  std::vector<GateReport> reports;
  for (std::size_t k = 0; k < list.size(); ++k) reports.push_back(hold_against_file(baselines[k], list[k]));
  if (!options.junit.empty()) write_text("JUnit file", options.junit, gate_junit(reports));
  if (!options.summary.empty()) write_text("summary file", options.summary, gate_markdown(reports));
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
      "check", "compare results with a stored baseline; exit code 1 if a result got worse or was not compared");
  command->add_option("results", options.results, "results files of method grids, or JSON of Google Benchmark")
      ->required();
  auto* where = command->add_option_group("baseline", "compare with a baseline, or write one");
  where->add_option("--baseline", options.baseline, "compare with this baseline FILE, or with other results");
  where->add_option("--baselines", options.baselines, "compare with FOLDER/EXPERIMENT.jsonl");
  auto* write = where->add_option("--write", options.new_baseline, "write the results to a new baseline FILE");
  auto* replace = where->add_option("--replace", options.replaced, "replace FOLDER/EXPERIMENT.jsonl");
  where->require_option(1);
  auto* as_json = command->add_flag("--json", options.as_json, "print JSON");
  auto* for_github =
      command->add_flag("--github", options.for_github,
                        "print annotations for GitHub Actions and write a summary to $GITHUB_STEP_SUMMARY");
  auto* junit = command->add_option("--junit", options.junit, "write JUnit XML to FILE");
  auto* summary = command->add_option("--summary", options.summary, "write a summary in Markdown to FILE");
  as_json->excludes(for_github);
  for (auto* option : {as_json, for_github, junit, summary})
    option->excludes(write)->excludes(replace);  // nothing is held
  command->footer(
      "Examples:\n"
      "  ricochet check out/mine/two_balls_order.jsonl --baseline reports/baselines/two_balls_order.jsonl\n"
      "  ricochet check out/mine/two_balls_order.jsonl --baselines reports/baselines --junit out/gate.xml --json\n"
      "  ricochet check out/mine/two_balls_order.jsonl --write out/mine_baseline.jsonl");
  command->callback([&exit_code] {
    if (!options.new_baseline.empty() || !options.replaced.empty())
      write_baselines(read_all(options.results), options);
    else
      exit_code = check(options);
  });
}

}  // namespace ricochet
