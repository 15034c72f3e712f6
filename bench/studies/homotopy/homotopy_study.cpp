#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/measure/problem_choice.h"
#include "bench/rows/progress.h"
#include "bench/studies/homotopy/homotopy.h"
#include "bench/studies/homotopy/homotopy_rows.h"
#include "methods/fesd_homotopy/options.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// The experiment: the equations of every step of FESD-J runs, solved by pivoting and by homotopies.
///
///   "problem"                problem_choice.h
///   "families", "stages"     tableaus: each family with 1 to so many stages
///   "steps"                  N_sim of the runs
///   "margin"                 steps before and after one with an impact that are solved; -1: all
///   "guess", "relaxation", "sigma_0", "factor"   lists of values of these options of `fesd_homotopy`, in every
///                            combination; one that is not there has its default
///   "options"                of all homotopies: "retry=0,max_iterations=200"
struct HomotopyExperiment {
  ProblemChoice problem;
  std::vector<std::string> families;
  int stages = 0, margin = 0;
  std::vector<int> steps;
  std::vector<std::string> solvers;  ///< options of a homotopy
};

StepHomotopy::Options homotopy_options_of(const std::string& text) {
  const MethodSpec spec("fesd_homotopy:radau-iia:2" + (text.empty() ? "" : "," + text));
  StepHomotopy::Options result = step_homotopy_options(spec);
  spec.finish(2);
  return result;
}

/// Every combination of the values of the options that the experiment lists.
std::vector<std::string> combinations(const json& experiment) {
  std::vector<std::string> texts = {experiment.value("options", "")};
  for (const char* option : {"factor", "sigma_0", "relaxation", "guess"}) {
    if (!experiment.contains(option)) continue;
    std::vector<std::string> more;
    for (const std::string value : experiment[option]) {
      for (const auto& text : texts)
        more.push_back(fmt::format("{}={}{}{}", option, value, text.empty() ? "" : ",", text));
    }
    texts = std::move(more);
  }
  for (const auto& text : texts) homotopy_options_of(text);  // a bad one throws here
  return texts;
}

HomotopyExperiment read_homotopy_experiment(const json& experiment) {
  HomotopyExperiment read;
  read.problem = read_problem_choice(experiment);
  experiment.at("families").get_to(read.families);
  experiment.at("stages").get_to(read.stages);
  experiment.at("steps").get_to(read.steps);
  experiment.at("margin").get_to(read.margin);
  if (read.stages < 1) throw InputError("stages", read.stages, "a number >= 1 is required");
  for (const int N : read.steps) {
    if (N < 1) throw InputError("steps", N, "numbers >= 1 are required");
  }
  read.solvers = combinations(experiment);
  if (experiment.value("quick", false)) read.steps.resize(std::min<std::size_t>(read.steps.size(), 2));
  return read;
}

/// One run of the pivoting solver, which is made when a row needs it, and what homotopies make of its steps.
class ComparedRun {
 public:
  ComparedRun(const Problem& problem, const reference::Reference& reference, const std::string& family, int stages,
              int N)
      : problem_(problem), reference_(reference), family_(family), stages_(stages), N_(N) {}

  HomotopyRow by_pivoting() {
    const PivotingRun& run = pivoting();
    HomotopyRow row = empty_row("pivoting");
    for (std::size_t k = 0; k < run.has_impact.size(); ++k)
      (run.has_impact[k] ? row.impact_milliseconds : row.free_milliseconds).push_back(run.milliseconds[k]);
    row.steps = static_cast<int>(run.has_impact.size());
    if (run.status == Status::success) {
      row.error = error_of(run.q.back(), run.v.back());
    } else {
      ++row.steps;
      row.failed = 1;
      row.failures = {run.message};
    }
    return row;
  }

  HomotopyRow by_homotopy(const std::string& options, int margin) {
    const HomotopyRun run = run_homotopy(problem_, pivoting(), homotopy_options_of(options), margin);
    HomotopyRow row = empty_row(options);
    row.steps = run.steps;
    row.failed = run.failed;
    row.retried = run.retried;
    row.free_milliseconds = run.milliseconds[0];
    row.impact_milliseconds = run.milliseconds[1];
    row.distances = run.distances;
    row.failures = run.failures;
    row.solves_infeasible = run.solves_infeasible;
    if (run.is_complete) row.error = error_of(run.q, run.v);
    return row;
  }

 private:
  HomotopyRow empty_row(const std::string& solver) const {
    HomotopyRow row;
    row.family = family_;
    row.solver = solver;
    row.stages = stages_;
    row.run_steps = N_;
    row.error = std::numeric_limits<double>::quiet_NaN();
    return row;
  }
  const PivotingRun& pivoting() {
    if (!pivoting_) pivoting_ = run_pivoting(problem_, make_tableau(family_, stages_), N_);
    return *pivoting_;
  }
  double error_of(const Vector& q, const Vector& v) const {
    Solution solution;
    solution.q = q;
    solution.v = v;
    return reference_.error_of(solution);
  }

  const Problem& problem_;
  const reference::Reference& reference_;
  std::string family_;
  int stages_, N_;
  std::optional<PivotingRun> pivoting_;
};

/// A tableau with a number of steps.
struct PlannedRun {
  std::string family;
  int stages = 0, N = 0;

  bool operator==(const PlannedRun&) const = default;
};

std::vector<PlannedRun> planned_runs(const HomotopyExperiment& experiment) {
  std::vector<PlannedRun> runs;
  for (const auto& family : experiment.families) {
    for (int stages = 1; stages <= experiment.stages; ++stages) {
      for (const int N : experiment.steps) runs.push_back({family, stages, N});
    }
  }
  return runs;
}

/// A piece is one run by one solver. Each needs the run by pivoting, which is quick, and kept while pieces of it follow.
void run_homotopy_study(const json& document, ResultsFile& file) {
  const HomotopyExperiment experiment = read_homotopy_experiment(document);
  const auto problem = experiment.problem.make_problem();
  const auto reference = experiment.problem.make_reference(*problem);
  const bool with_times = document.value("times", true);
  const auto runs = planned_runs(experiment);
  const std::size_t n_solvers = 1 + experiment.solvers.size(), n = runs.size() * n_solvers;
  std::optional<ComparedRun> run;
  std::optional<PlannedRun> at_hand;
  const auto solve = [&](std::size_t k) {
    const PlannedRun& planned = runs[k / n_solvers];
    if (at_hand != planned) run.emplace(*problem, reference, planned.family, planned.stages, planned.N);
    at_hand = planned;
    HomotopyRow row = k % n_solvers == 0 ? run->by_pivoting()
                                         : run->by_homotopy(experiment.solvers[k % n_solvers - 1], experiment.margin);
    if (!with_times) row.free_milliseconds = row.impact_milliseconds = {};
    return row;
  };
  Progress progress(document.at("id").get<std::string>());
  file.each<HomotopyRow>(n, solve, [&](std::size_t k) {
    const PlannedRun& planned = runs[k / n_solvers];
    progress.update(static_cast<double>(k + 1) / static_cast<double>(n),
                    fmt::format("{}:{} N = {}", planned.family, planned.stages, planned.N));
  });
}

void show_homotopy(const Results& results, Section& section) {
  const auto rows = results.all<HomotopyRow>();
  section.result("solvers", homotopy_table(rows));
  section.details("failures", homotopy_failures(rows));
}

constexpr const char* kHomotopyFields = R"~({
  "required": ["problem", "families", "stages", "steps", "margin"],
  "properties": {
    "problem": {"$ref": "#/$defs/problem", "examples": ["two_balls_spring"]},
    "parameters": {"$ref": "#/$defs/parameters", "examples": [{"k": 1e4}]},
    "families": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "Of tableaus.", "examples": [["radau-iia"]]},
    "stages": {"type": "integer", "minimum": 1, "description": "Each family with 1 to so many stages.", "examples": [4]},
    "steps": {"type": "array", "minItems": 1, "items": {"type": "integer", "minimum": 1}, "description": "N_sim of the runs: numbers >= 1.", "examples": [[50, 80]]},
    "margin": {"type": "integer", "minimum": -1, "description": "Number of steps before and after a step with an impact that are solved; -1: all.", "examples": [0]},
    "guess": {"type": "array", "items": {"type": "string"}, "description": "Values of this option of fesd_homotopy; every combination with the next three is run.", "examples": [["cold"]]},
    "relaxation": {"type": "array", "items": {"type": "string"}, "description": "Likewise.", "examples": [["scholtes"]]},
    "sigma_0": {"type": "array", "items": {"type": "string"}, "description": "Likewise.", "examples": [["1e-1"]]},
    "factor": {"type": "array", "items": {"type": "string"}, "description": "Likewise.", "examples": [["0.1"]]},
    "options": {"type": "string", "description": "Of all homotopies.", "examples": ["retry=0"]}
  }
})~";

// The study counts steps that a homotopy does not find, so that none of them is unexpected.
const bool homotopy_is_registered =
    register_study({.kind = "homotopy",
                    .summary = "the equations of FESD-J by homotopy, against the pivoting solver",
                    .fields = kHomotopyFields,
                    .rows = {HomotopyRow::kKind},
                    .reads_quick = true,
                    .times = Times::in_rows,
                    .run = run_homotopy_study,
                    .show = show_homotopy,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
