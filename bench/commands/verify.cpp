#include "bench/studies/verify/verify.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/experiment/experiment_file.h"
#include "bench/experiment/run_experiment.h"
#include "bench/experiment/selection.h"
#include "bench/rows/progress.h"
#include "bench/studies/verify/scorecard.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct VerifyOptions {
  std::string method, battery = "verify";
  std::vector<std::string> only, known;
  bool quick = false, as_json = false, lists = false;
  double time_limit = 0;
  std::string junit, badge, summary;
};

void require_room(const VerifyOptions& options) {
  if (!options.junit.empty()) require_writable_there("JUnit file", options.junit);
  if (!options.badge.empty()) require_writable_there("badge", options.badge);
  if (!options.summary.empty()) require_writable_there("summary file", options.summary);
}

/// The checks that are asked for. @throws InputError for a pattern that fits none
std::vector<Check> chosen(std::vector<Check> battery, const std::vector<std::string>& patterns) {
  if (patterns.empty()) return battery;
  std::vector<std::string> names;
  for (const auto& check : battery) names.push_back(check.full_name());
  for (const auto& pattern : patterns) {
    if (std::ranges::none_of(names, [&](const std::string& name) { return matches(name, pattern); }))
      throw_unknown_name("check", pattern, names);
  }
  std::vector<Check> list;
  for (auto& check : battery) {
    const std::string name = check.full_name();
    if (std::ranges::any_of(patterns, [&](const std::string& pattern) { return matches(name, pattern); }))
      list.push_back(std::move(check));
  }
  return list;
}

int verify(const VerifyOptions& options) {
  if (options.method.empty() && !options.lists) throw InputError("--method", "''", "a method is required");
  RunOptions run;
  run.quick = options.quick;
  run.time_limit = options.time_limit;
  const ExperimentFile file = read_experiment_file(options.battery);
  if (file.kind() != "verify")
    throw InputError("--battery", options.battery, "an experiment of kind verify is required");
  const nlohmann::json experiment = experiment_document(file, run);
  const auto battery = chosen(battery_of(experiment), options.only);
  if (options.lists) {
    for (const auto& check : battery) fmt::print("{}\n", check.full_name());
    return 0;
  }
  require_room(options);
  const Subject subject = subject_of(options.method, experiment.at("time_limit"));
  Scorecard card{options.method, {}, options.known};
  Progress progress("verify " + options.method);
  for (std::size_t k = 0; k < battery.size(); ++k) {
    progress.update(static_cast<double>(k) / static_cast<double>(battery.size()), battery[k].name);
    card.rows.push_back(run_check(battery[k], subject));
  }
  if (options.as_json)
    fmt::print("{}\n", scorecard_json(card).dump(1, ' ', false, nlohmann::json::error_handler_t::replace));
  else
    fmt::print("{}", scorecard_text(card));
  if (!options.junit.empty()) write_text("JUnit file", options.junit, scorecard_junit(card));
  if (!options.badge.empty()) write_text("badge", options.badge, scorecard_badge(card));
  if (!options.summary.empty()) write_text("summary file", options.summary, scorecard_markdown(card));
  return card.holds() ? 0 : 1;
}

}  // namespace

void add_verify_command(CLI::App& app, int& exit_code) {
  static VerifyOptions options;
  auto* command = app.add_subcommand(
      "verify",
      "check a method and print its scorecard: orders, sensitivities, truth, promises, hard cases; exit code 1 if a "
      "check fails unexpectedly");
  command->add_option("--method,-m", options.method, "method, see `ricochet list methods`");
  command->add_flag("--quick", options.quick, "run the short battery, which takes seconds");
  command->add_option("--check", options.only, "run only this check, GROUP/CHECK or a pattern with *; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--known", options.known,
                   "allow this check to fail, GROUP/CHECK or a pattern with *; may be repeated")
      ->allow_extra_args(false);
  command->add_flag("--list", options.lists, "print the names of the checks and run none");
  command->add_option("--battery", options.battery, "experiment of kind verify: a name or a file")
      ->capture_default_str();
  command->add_option("--time-limit", options.time_limit, "limit of the wall time of a check in seconds")
      ->check(positive_number());
  command->add_flag("--json", options.as_json, "print JSON (schema ricochet-scorecard-1)");
  command->add_option("--junit", options.junit, "write the scorecard to FILE as JUnit XML");
  command->add_option("--badge", options.badge, "write a badge to FILE as SVG");
  command->add_option("--summary", options.summary, "write a summary to FILE in Markdown");
  command->footer(
      "Examples:\n"
      "  ricochet verify --method moreau_jean --quick\n"
      "  ricochet verify --method 'external:python3 euler.py' --junit scorecard.xml --badge scorecard.svg\n"
      "  ricochet verify --method fesd:gauss:4 --check 'order/*' --check truth/P1a_ball_e09\n"
      "  ricochet verify --method moreau_jean --known 'order/impacts' --known 'hard case/*'");
  command->callback([&exit_code] { exit_code = verify(options); });
}

}  // namespace ricochet
