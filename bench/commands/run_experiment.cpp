#include "bench/experiment/run_experiment.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <optional>

#include "bench/commands/ad_hoc_experiment.h"
#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/commands/show.h"
#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/site/history_page.h"
#include "bench/site/report_site.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

struct ExperimentCommand {
  std::string experiment;  ///< empty: the ad-hoc one
  AdHocStudy ad_hoc = {};
  RunOptions run = {};
  PrintOptions print = {};
  std::string page = {};           ///< folder; empty: none
  std::string history = {};        ///< folder of ./run history, for the site; empty: none
  bool prints_experiment = false;  ///< prints the experiment instead of running it
};

/// Results of the names of "also_shown" that are there.
std::vector<std::string> also_shown(const ExperimentFile& experiment, const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& name : experiment.document.value("also_shown", std::vector<std::string>())) {
    const fs::path path = fs::path(folder) / (name + ".jsonl");
    if (fs::exists(path)) paths.push_back(path);
  }
  return paths;
}

/// The site of the results of one experiment or of several. It is written after the first experiment, then at most every
/// kPause, and after the last, so that it can be read while the others run.
class SiteOfParts {
 public:
  /// @param more  results that are shown, too
  SiteOfParts(std::string folder, std::vector<std::string> more, std::vector<SitePage> history)
      : folder_(std::move(folder)), more_(std::move(more)), history_(std::move(history)) {}

  void update(std::vector<std::string> paths, bool is_last) {
    if (written_ && !is_last && Clock::now() - *written_ < kPause) return;
    paths.insert(paths.end(), more_.begin(), more_.end());
    std::vector<ShownResults> list;
    for (const auto& path : paths) list.push_back(shown_results(path));
    const std::string site = write_report_site(list, folder_, history_);
    if (!written_ || is_last) fmt::print("report: {}\n{}", site, is_last ? "" : "\n");
    written_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPause{15};

  std::string folder_;
  std::vector<std::string> more_;
  std::vector<SitePage> history_;
  std::optional<Clock::time_point> written_;
};

/// In the order in which one reads it.
std::string experiment_text(const nlohmann::json& document) {
  nlohmann::ordered_json text;
  for (const char* field : {"id", "kind", "title", "description", "problem", "parameters", "reference"}) {
    if (document.contains(field)) text[field] = document[field];
  }
  for (const auto& [field, value] : document.items()) text[field] = value;
  return text.dump(2);
}

/// Runs the experiment, or each of its parts, and prints the results. @return the exit code
int run_and_show(const ExperimentCommand& command) {
  const ExperimentFile experiment =
      command.experiment.empty() ? ad_hoc_experiment(command.ad_hoc) : read_experiment_file(command.experiment);
  std::vector<ExperimentFile> parts;
  for (const auto& name : experiment.parts())
    parts.push_back(name == experiment.name ? experiment : read_experiment_file(name));
  if (parts.size() > 1 && !command.run.changes.empty())
    throw InputError("--set", command.run.changes.front(), "an experiment without parts is required");
  parts = selected_parts(parts, command.run);
  for (const auto& part : parts) {
    const nlohmann::json document =
        experiment_document(part, command.run);  // of the last, too, before the first is run
    if (command.prints_experiment) fmt::print("{}\n", experiment_text(document));
  }
  if (command.prints_experiment) return 0;
  require_writable_folder("results folder", command.run.folder);
  if (!command.page.empty()) require_writable_folder("folder of the site", command.page);
  // A damaged history is an error before the runs, not after them.
  SiteOfParts site(command.page, also_shown(experiment, command.run.folder), history_pages(command.history));
  // The tables of several experiments are a thousand lines: the page shows them.
  const bool is_summary =
      parts.size() > 1 && !command.page.empty() && command.print.views.empty() && !command.print.all;
  std::vector<std::string> paths;
  int failed = 0;
  for (const auto& part : parts) {
    paths.push_back(run_experiment(part, command.run));
    if (!command.run.shard.is_all()) {
      fmt::print("shard: {}\n", paths.back());
      continue;
    }
    const ShownResults shown = shown_results(paths.back());
    is_summary ? print_summary(shown) : print_results(shown, command.print);
    const int here = unexpected_failures(shown.results);
    if (here > 0) fmt::print("{} rows failed unexpectedly\n\n", here);
    failed += here;
    if (!command.page.empty()) site.update(paths, paths.size() == parts.size());
  }
  return failed > 0 ? 1 : 0;
}

}  // namespace

void add_run_experiment_command(CLI::App& app, int& exit_code) {
  static ExperimentCommand options;
  static std::vector<std::string> methods, problems;
  static bool without_times = false;
  static std::string shard_text, times_text;
  auto* command = app.add_subcommand(
      "run-experiment",
      "run an experiment, unless its results exist, and print its tables; exit code 1 if a row fails unexpectedly");
  auto* experiment = command->add_option(
      "experiment", options.experiment,
      "name, see `ricochet list experiments`, or a file; without it the options define an experiment");
  command
      ->add_option(
          "--method,-m", methods,
          "run only this method of the experiment, a name or a pattern with *, and store the results as ID_part; "
          "without an experiment: a method to run. May be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--problem,-p", problems,
                   "run only this problem of the experiment, likewise; without an experiment: the problem, "
                   "NAME,PARAMETER=VALUE,...")
      ->allow_extra_args(false);
  command
      ->add_option("--scene,-s", options.ad_hoc.scene,
                   "without an experiment: the problem, FILE.json or FILE.json#ID, optionally with ,PARAMETER=VALUE")
      ->excludes(experiment)
      ->excludes("--problem");
  command
      ->add_option(
          "--steps,-N", options.ad_hoc.steps,
          "without an experiment: steps of fixed-step methods, FROM..TO, FROM..TO:PER_DECADE or A,B,... (default: "
          "10..1000:8; 100 times as many for first-order methods)")
      ->excludes(experiment);
  command
      ->add_option("--tolerance", options.ad_hoc.tolerances,
                   "without an experiment: tolerances of error-controlled methods, likewise (default: 1e-3..1e-9:1)")
      ->excludes(experiment);
  command->add_flag("--print-experiment", options.prints_experiment, "print the experiment as a file and run nothing");
  command->add_option("-o,--out", options.run.folder, "folder of the results file")->capture_default_str();
  command->add_flag("--quick", options.run.quick,
                    "run the short form of the experiment and measure CPU times three times only");
  auto* no_times = command->add_flag("--no-times", without_times,
                                     "do not measure CPU times, unless they are the result of the experiment");
  command
      ->add_option(
          "--times", times_text,
          "how CPU times are taken: exclusive (idle machine) or shared (results are labelled). Required with --shard "
          "or --jobs if times are measured")
      ->excludes(no_times);
  command
      ->add_option(
          "--jobs,-j", options.run.jobs,
          "number of processes; requires --no-times or --times shared if the experiment measures times. The results "
          "are the same")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  auto* shard = command->add_option(
      "--shard", shard_text,
      "K/N: compute every N-th piece of the work, from the K-th, and write ID.shard-K-of-N.jsonl; requires --no-times "
      "or --times if the experiment measures times");
  command
      ->add_option("--from-shards", options.run.shards,
                   "merge the N shards in FOLDER; the results are those of a single process")
      ->excludes(shard);
  command->add_flag("--force", options.run.force,
                    "recompute existing results; the old file is kept with its date in its name");
  command->add_option("--data", options.run.data, "FOLDER of measured data, for experiments that read some");
  command->add_option("--time-limit", options.run.time_limit, "limit of the wall time of a run in seconds")
      ->check(positive_number());
  command
      ->add_option("--set", options.run.changes,
                   "FIELD=VALUE: replace a field of the experiment, by JSON or text, and store the results as ID_part")
      ->allow_extra_args(false);
  auto* page = command->add_option("--page", options.page, "write a site of the results to FOLDER");
  command->add_option("--history", options.history, "FOLDER of ./run history: add the history to the site")
      ->needs(page);
  add_print_options(*command, options.print);
  command->footer(
      "Examples:\n"
      "  ricochet run-experiment two_balls_order --quick\n"
      "  ricochet run-experiment two_balls_order --method 'fesd:gauss:*' --no-times --jobs 4\n"
      "  ricochet run-experiment hard_cases --no-times --shard 3/8 -o out/shards\n"
      "  ricochet run-experiment hard_cases --no-times --from-shards out/shards\n"
      "  ricochet run-experiment opponents --times exclusive --shard 3/8 -o out/shards\n"
      "  ricochet run-experiment --problem bouncing_ball,e=0.9 --method moreau_jean --method fesd:gauss:2 --steps "
      "20..400\n"
      "  ricochet run-experiment --scene block.json --print-experiment\n"
      "  ricochet run-experiment zeno --page out/report\n"
      "  ricochet run-experiment hard_cases --problem disc_in_chute --method moreau_jean --view failures");
  command->callback([&exit_code] {
    options.run.with_times = !without_times;
    if (!times_text.empty()) options.run.times = read_times_mark(times_text);
    if (!shard_text.empty()) options.run.shard = read_shard(shard_text);
    if (options.experiment.empty()) {
      if (problems.size() > 1)
        throw InputError("--problem", problems[1], "without an experiment, exactly one problem is required");
      options.ad_hoc.methods = methods;
      if (!problems.empty()) options.ad_hoc.problem = problems.front();
    } else {
      options.run.selection = {methods, problems};
    }
    exit_code = run_and_show(options);
  });
}

}  // namespace ricochet
