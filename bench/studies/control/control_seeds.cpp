#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bench/control/control_guess.h"
#include "bench/control/replay.h"
#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/measure/timing.h"
#include "bench/rows/progress.h"
#include "bench/studies/control/leave_times_out.h"
#include "bench/studies/control/seed_rows.h"
#include "problems/input_error.h"
#include "reports/performance_profile.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kSeedReplayTolerance = 1e-9;

/// Runs that are still to be made: everything but the results. Those of one problem alternate between its entries, so
/// that other work on the machine slows down all of them.
std::vector<SeedRun> runs_of(const json& document) {
  std::vector<SeedRun> runs;
  for (std::size_t k = 0; k < document.at("runs").size(); ++k) {
    const json& entry = document["runs"][k];
    const auto field = [&](const std::string& name) { return fmt::format("runs[{}].{}", k, name); };
    const int n_seeds = entry.at("seeds");
    const double time_limit = entry.at("time_limit");
    SeedRun run;
    run.problem = entry.at("problem");
    run.arguments = fmt::format("{} --time-limit {:g}", entry.at("arguments").get<std::string>(), time_limit);
    for (const char* option : {"--seed", "--time-limit"}) {
      if (entry["arguments"].get<std::string>().find(option) != std::string::npos)
        throw InputError(field("arguments"), entry["arguments"].get<std::string>(),
                         fmt::format("no {}, which is set for each run, is required", option));
    }
    const ControlOptions options = ControlOptions::parse(fmt::format("{} {}", run.problem, run.arguments));
    options.make_problem();  // bad ones throw here
    run.method = options.method;
    if (!options.is_shooting()) run.linear_solver = options.linear_solver;
    for (int seed = 1; seed <= n_seeds; ++seed) {
      run.seed = static_cast<unsigned>(seed);
      runs.push_back(run);
    }
  }
  const auto problems = different(runs, &SeedRun::problem);
  std::ranges::stable_sort(
      runs, {}, [&](const SeedRun& run) { return std::pair(std::ranges::find(problems, run.problem), run.seed); });
  return runs;
}

/// Solves, and fills in the results.
SeedRun solve_from_seed(SeedRun run) {
  const ControlOptions options =
      ControlOptions::parse(fmt::format("{} {} --seed {}", run.problem, run.arguments, run.seed));
  const auto begin = std::chrono::steady_clock::now();
  const double cpu_begin = cpu_seconds();
  const auto problem = options.make_problem();
  const PreparedMethod method = prepared_method(options, *problem);
  const double solve_begin = cpu_seconds();
  const ControlSolution solution = method.solver->solve();
  run.solve_cpu_seconds = cpu_seconds() - solve_begin;
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.cpu_seconds = cpu_seconds() - cpu_begin;
  run.status = to_string(solution.status);
  run.message = solution.message;
  run.iterations = solution.iterations;
  run.terminal = std::numeric_limits<double>::quiet_NaN();
  if (!solution.succeeded()) return run;

  run.cost = solution.trajectory.objective;
  run.stationarity = solution.stationarity.substr(0, solution.stationarity.find(','));
  run.is_b_stationary = solution.is_b_stationary;
  const Replay truth = replay(*problem, solution.trajectory, pivoting_solver(kSeedReplayTolerance));
  run.replay_status = to_string(truth.status);
  if (truth.status == Status::success) run.terminal = mismatch(*problem, solution.trajectory, truth).terminal;
  return run;
}

/// From random initial guesses, the seeds 1 to n of each problem, one run after the other. "runs": [{"problem",
/// "arguments": of `ricochet control`, without --seed and --time-limit, "seeds": n, "time_limit": wall time of a run
/// [s]}]
void run_control_seeds(const json& experiment, ResultsFile& file) {
  const std::vector<SeedRun> runs = runs_of(experiment);
  if (experiment.contains("goals")) file.header()["goals"] = experiment["goals"];
  const bool with_times = experiment.value("times", true);
  Progress progress(experiment.at("id").get<std::string>());
  const auto solve = [&](std::size_t k) {
    SeedRun run = solve_from_seed(runs[k]);
    if (!with_times) leave_times_out(run);
    return run;
  };
  file.each<SeedRun>(runs.size(), solve, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(runs.size()), runs[k].problem);
  });
}

/// Arguments against each other on the guesses of one problem, which all of them start from.
void add_profiles(const std::vector<SeedRun>& runs, const std::string& prefix, Section& section) {
  for (const auto& problem : different(runs, &SeedRun::problem)) {
    std::vector<std::string> solvers;
    std::vector<std::vector<double>> times;
    unsigned n_seeds = 0;
    for (const SeedRun& run : runs) n_seeds = run.problem == problem ? std::max(n_seeds, run.seed) : n_seeds;
    const auto groups = seed_groups(runs);
    for (const auto& group : groups) {
      if (group.front()->problem != problem) continue;
      solvers.push_back(solver_name(group, groups));
      auto& of_group = times.emplace_back(n_seeds, HUGE_VAL);
      for (const SeedRun* run : group) {
        if (run->succeeded() && run->seed > 0) of_group[run->seed - 1] = run->cpu_seconds;
      }
    }
    if (solvers.size() < 2) continue;
    const PerformanceProfile profile(solvers, times);
    const std::string name = "profile_" + problem, title = "Performance profiles over random guesses, " + problem;
    profile.show(
        section, name, title,
        fmt::format("Share of {} guesses solved in at most tau times the CPU time of the fastest; one without a "
                    "solution takes infinitely long (Dolan, Moré 2002). It says nothing of the cost that was found.",
                    n_seeds),
        prefix + "_" + name);
  }
}

void show_control_seeds(const Results& results, Section& section) {
  const auto runs = results.all<SeedRun>();
  section.result("success", seed_table(runs));
  if (const auto comparisons = seed_comparisons(runs); !comparisons.empty())
    section.result("comparison", comparison_table(comparisons, results.header));
  if (const auto comparisons = linear_solver_comparisons(runs); !comparisons.empty())
    section.result("linear_solvers",
                   comparison_table(comparisons, results.header, {"Linear solvers of the homotopy", "mumps", "ldl"}));
  section.chart(seed_chart(runs, results.experiment()));
  if (std::ranges::any_of(runs, &SeedRun::is_timed)) add_profiles(runs, results.experiment(), section);
  section.failures("failures", seed_failures(runs));
  section.details("runs", seed_details(runs));
}

const std::string kControlSeedsFields = std::string(R"~({
  "required": ["runs"],
  "properties": {
    )~") + kGoalsField + R"~(,
    "runs": {"type": "array", "description": "Problems.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "arguments", "seeds", "time_limit"], "properties": {
        "problem": {"type": "string", "description": "Of `ricochet control`.", "examples": ["discs"]},
        "arguments": {"type": "string", "description": "Of `ricochet control`, without --seed and --time-limit.", "examples": ["--noise 0.5"]},
        "seeds": {"type": "integer", "minimum": 1, "description": "n: random initial guesses from the seeds 1 to n.", "examples": [50]},
        "time_limit": {"type": "number", "exclusiveMinimum": 0, "description": "Wall time of a run [s].", "examples": [300]}}}}
  }
})~";

// The study counts guesses without a solution, so that none of them is unexpected.
const bool control_seeds_is_registered =
    register_study({.kind = "control_seeds",
                    .summary = "optimal control from random initial guesses: success, cost, time",
                    .fields = kControlSeedsFields,
                    .rows = {SeedRun::kKind},
                    .times = Times::in_rows,
                    .run = run_control_seeds,
                    .show = show_control_seeds,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
