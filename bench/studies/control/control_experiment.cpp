#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/control/control_claim.h"
#include "bench/control/control_options.h"
#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "bench/studies/control/control_views.h"
#include "bench/studies/control/goals.h"
#include "bench/studies/control/leave_times_out.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr const char* kCommand = "ricochet control ";

int variables_of(const ControlOptions& options) {
  const auto problem = options.make_problem();
  return options.make_transcription(*problem)->mpcc().nlp.n_variables();
}

/// Steps per interval with which time stepping has so many variables, as nearly as possible.
int steps_of_equal_size(int variables, ControlOptions options) {
  const auto problem = options.make_problem();
  const auto size = [&](int steps) {
    options.steps = steps;
    return options.make_transcription(*problem)->mpcc().nlp.n_variables();
  };
  const int one = size(1), two = size(2);
  return std::max(1, static_cast<int>(std::lround(1 + static_cast<double>(variables - one) / (two - one))));
}

/// The runs of an entry of "runs": by the homotopy with FESD-J, and with time stepping of the same number of variables,
/// and by shooting if the entry has arguments for it.
std::vector<const char*> kinds_of(const json& entry) {
  std::vector<const char*> kinds{"fesd", "time_stepping"};
  if (entry.contains(kShooting)) kinds.push_back(kShooting);
  return kinds;
}

/// The arguments of `ricochet control` for one of these runs, with the options they make.
std::pair<ControlOptions, std::string> run_options(const json& entry, const std::string& kind) {
  const auto of = [&](const char* field, const std::string& option) {
    return fmt::format("{}{} {}", entry.at("problem").get<std::string>(), option, entry.at(field).get<std::string>());
  };
  if (kind == kShooting) {
    const std::string arguments = of(kShooting, " --method shooting");
    return {ControlOptions::parse(arguments), arguments};
  }
  const std::string fesd = of("fesd", "");
  if (kind == "fesd") return {ControlOptions::parse(fesd), fesd};
  const std::string arguments = of("time_stepping", " --discretisation time_stepping");
  ControlOptions options = ControlOptions::parse(arguments);
  options.steps = steps_of_equal_size(variables_of(ControlOptions::parse(fesd)), options);
  return {options, fmt::format("{} --steps {}", arguments, options.steps)};
}

/// Problems by several methods; the controls are replayed. "runs": [{"problem", "fesd", "time_stepping", "shooting"}],
/// with the arguments of `ricochet control`. Each run is a piece.
void run_control_experiment(const json& experiment, ResultsFile& file) {
  const bool with_times = experiment.value("times", true);
  if (experiment.contains("goals")) file.header()["goals"] = experiment["goals"];
  std::vector<std::pair<const json*, const char*>> runs;
  for (const json& entry : experiment.at("runs")) {
    for (const char* kind : kinds_of(entry)) {
      if (std::string(kind) != "time_stepping") run_options(entry, kind).first.make_problem();  // bad ones throw here
      runs.emplace_back(&entry, kind);
    }
  }
  const auto run_of = [&](std::size_t k) {
    const auto [options, arguments] = run_options(*runs[k].first, runs[k].second);
    return solve_and_replay(options, kCommand + arguments);
  };
  const auto solve = [&](std::size_t k) {
    ControlRun run = run_of(k);
    if (!with_times) leave_times_out(run);
    return run;
  };
  Progress progress(experiment.at("id").get<std::string>());
  file.each<ControlRun>(runs.size(), solve, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(runs.size()), runs[k].first->at("problem"));
  });
}

/// The problem of a run, by its command.
std::shared_ptr<const OptimalControlProblem> problem_of(const ControlRun& run) {
  return ControlOptions::parse(run.command.substr(std::string(kCommand).size())).make_problem();
}

/// Frames, animation and curves of the runs of one problem.
void show_problem(const std::vector<ControlRun>& runs, const std::string& name, Section& section) {
  section.heading(fmt::format("{}: {}", runs.front().problem, runs.front().title));
  for (const char* method : {kHomotopy, kShooting}) {
    const auto solved =
        std::ranges::find_if(runs, [&](const ControlRun& run) { return run.succeeded() && run.method == method; });
    const auto problem = solved == runs.end() ? nullptr : problem_of(*solved);
    if (!problem || !problem->plant->info().geometry) continue;
    const std::string prefix = name + (solved->method == kHomotopy ? "" : "_" + solved->method);
    section.drawings([=, run = *solved](const FigureFolder& folder) {
      return std::vector{draw_frames(folder, *problem, run, prefix + "_frames")};
    });
    section.drawings([=, run = *solved](const FigureFolder& folder) {
      return std::vector{draw_scene(folder, *problem, run, prefix + "_scene")};
    });
  }
  section.chart(control_chart(runs, name));
  if (std::ranges::any_of(runs, [](const ControlRun& run) { return !run.progress_cost.empty(); }))
    section.chart(progress_chart(runs, name + "_progress"));
}

/// Cost and time of the two methods with FESD-J.
std::vector<Comparison> comparisons_of(const std::vector<ControlRun>& runs) {
  std::vector<Comparison> comparisons;
  for (const auto& run : runs) {
    if (run.method != kShooting || !run.succeeded()) continue;
    const auto other = std::ranges::find_if(runs, [&](const ControlRun& r) {
      return r.problem == run.problem && r.method == kHomotopy && r.discretisation.starts_with("FESD-J");
    });
    if (other == runs.end() || !other->succeeded()) continue;
    comparisons.push_back(quotient(run.problem, "cost", other->claimed_cost, run.claimed_cost));
    if (run.seconds > 0) comparisons.push_back(quotient(run.problem, "seconds", other->seconds, run.seconds));
  }
  return comparisons;
}

void show_control_experiment(const Results& results, Section& section) {
  const auto runs = results.all<ControlRun>();
  section.result("runs", control_table(runs));
  if (const auto comparisons = comparisons_of(runs); !comparisons.empty())
    section.result("comparison", comparison_table(comparisons, results.header));
  section.failures("failures", control_failures(runs));
  for (std::size_t first = 0, last = 0; first < runs.size(); first = last) {
    while (last < runs.size() && runs[last].problem == runs[first].problem) ++last;
    show_problem({runs.begin() + static_cast<std::ptrdiff_t>(first), runs.begin() + static_cast<std::ptrdiff_t>(last)},
                 results.experiment() + "_" + runs[first].problem, section);
  }
}

/// Time stepping stands beside FESD-J for comparison: it may fail, and the table says so.
int control_experiment_unexpected_failures(const Results& results) {
  const auto runs = results.all<ControlRun>();
  return static_cast<int>(std::ranges::count_if(
      runs, [](const ControlRun& run) { return !run.succeeded() && run.discretisation.starts_with("FESD-J"); }));
}

const std::string kControlExperimentFields = std::string(R"~({
  "required": ["runs"],
  "properties": {
    )~") + kGoalsField + R"~(,
    "runs": {"type": "array", "description": "Problems, each with FESD-J and with time stepping.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "fesd", "time_stepping"], "properties": {
        "problem": {"type": "string", "description": "Of `ricochet control`.", "examples": ["two_carts"]},
        "fesd": {"type": "string", "description": "Arguments of `ricochet control` with FESD-J.", "examples": ["--intervals 10"]},
        "shooting": {"type": "string", "description": "Those of --method shooting; without them it does not run.", "examples": ["--explore 12"]},
        "time_stepping": {"type": "string", "description": "Those with time stepping.", "examples": ["--sigma-0 1"]}}}}
  }
})~";

const bool control_experiment_is_registered = register_study(
    {.kind = "optimal_control",
     .summary = "optimal control with FESD-J, by homotopy and shooting, and with time stepping: claims and truth",
     .fields = kControlExperimentFields,
     .rows = {ControlRun::kKind},
     .times = Times::in_rows,
     .run = run_control_experiment,
     .show = show_control_experiment,
     .unexpected_failures = control_experiment_unexpected_failures});

}  // namespace
}  // namespace ricochet
