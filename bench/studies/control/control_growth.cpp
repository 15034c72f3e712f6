#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <random>

#include "bench/control/control_guess.h"
#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "bench/studies/control/growth_rows.h"
#include "methods/control/shrinking_horizon.h"

namespace ricochet {
namespace {

using nlohmann::json;

ControlGrowth measure_growth(const std::string& arguments, double disturbance) {
  const ControlOptions options = ControlOptions::parse(arguments);
  const auto problem = options.make_problem();
  const PreparedMethod method = prepared_method(options, *problem);
  ShrinkingHorizon horizon(*problem, *method.solver);
  const ControlSolution solution = horizon.solve();

  ControlGrowth result;
  result.problem = problem->id;
  result.method = options.method;
  result.command = fmt::format("ricochet mpc {} --updates 1 --disturbance {}", arguments, disturbance);
  result.intervals = problem->n_intervals;
  result.variables = method.solver->n_variables();
  result.pairs = method.solver->n_pairs();
  result.status = to_string(solution.status);
  result.message = solution.message;
  result.iterations = solution.iterations;
  result.seconds = solution.seconds;
  result.derivative_seconds = solution.derivative_seconds;
  for (const auto& step : solution.steps)
    result.steps.push_back({step.sigma, step.iterations, step.seconds, step.complementarity, is_solved(step.status)});
  if (!solution.succeeded()) return result;

  result.cost = solution.trajectory.objective;
  const Status plant = horizon.advance();
  result.again_status = fmt::format("plant: {}", to_string(plant));
  if (plant != Status::success) return result;
  std::mt19937 random(options.exploration.seed);
  horizon.disturb(disturbance, random);
  const ControlSolution again = horizon.resolve();
  result.again_status = to_string(again.status);
  result.again_kept_branch = again.kept_branch;
  result.again_iterations = again.iterations;
  result.again_seconds = again.seconds;
  return result;
}

/// Removes everything that depends on the speed and load of the machine.
void leave_times_out(ControlGrowth& run) {
  run.seconds = run.derivative_seconds = run.again_seconds = std::numeric_limits<double>::quiet_NaN();
  for (auto& step : run.steps) step.seconds = run.seconds;
}

/// Measures the work of an optimal control solve over the number of control intervals, step by step of its homotopy,
/// and the work of a second solve, after the plant has run one interval and its positions were moved by up to
/// "disturbance". "runs": [{"problem", "arguments" of `ricochet control`, "intervals": a list; without it the problem's
/// own}]
void run_control_growth(const json& experiment, ResultsFile& file) {
  std::vector<std::string> commands;
  for (const auto& run : experiment.at("runs")) {
    const std::string command =
        fmt::format("{} {}", run.at("problem").get<std::string>(), run.at("arguments").get<std::string>());
    if (!run.contains("intervals")) commands.push_back(command);
    for (const int N : run.value("intervals", std::vector<int>()))
      commands.push_back(fmt::format("{} --intervals {}", command, N));
  }
  for (const auto& command : commands) ControlOptions::parse(command).make_problem();  // bad ones throw here
  if (experiment.contains("goals")) file.header()["goals"] = experiment["goals"];
  const double disturbance = experiment.at("disturbance");
  Progress progress(experiment.at("id").get<std::string>());
  const bool with_times = experiment.value("times", true);
  const auto solve = [&](std::size_t k) {
    ControlGrowth run = measure_growth(commands[k], disturbance);
    if (!with_times) leave_times_out(run);
    return run;
  };
  file.each<ControlGrowth>(commands.size(), solve, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(commands.size()), commands[k]);
  });
}

void show_control_growth(const Results& results, Section& section) {
  const auto runs = results.all<ControlGrowth>();
  section.result("work", growth_table(runs));
  if (const auto comparisons = growth_comparisons(runs); !comparisons.empty())
    section.result("comparison", comparison_table(comparisons, results.header));
  const bool is_timed = std::ranges::any_of(runs, [](const ControlGrowth& run) { return run.seconds > 0; });
  if (is_timed)
    section.chart(
        growth_chart(growth_curves(runs), results.experiment(), "Time of a solution", "intervals N", "seconds"));
  section.details("steps", homotopy_steps(runs));
}

int control_growth_unexpected_failures(const Results& results) {
  const auto runs = results.all<ControlGrowth>();
  return static_cast<int>(std::ranges::count_if(runs, [](const auto& run) { return !run.succeeded(); }));
}

const std::string kControlGrowthFields = std::string(R"~({
  "required": ["disturbance", "runs"],
  "properties": {
    )~") + kGoalsField + R"~(,
    "disturbance": {"type": "number", "minimum": 0, "description": "Positions are moved by up to this [m] before the second solve.", "examples": [0.001]},
    "runs": {"type": "array", "description": "Problems.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "arguments"], "properties": {
        "problem": {"type": "string", "description": "Of `ricochet control`.", "examples": ["two_carts"]},
        "arguments": {"type": "string", "description": "Of `ricochet control`.", "examples": ["--simulate"]},
        "intervals": {"type": "array", "items": {"type": "integer", "minimum": 1}, "description": "Numbers of control intervals; without them the problem's own.", "examples": [[10, 20]]}}}}
  }
})~";

const bool control_growth_is_registered =
    register_study({.kind = "control_growth",
                    .summary = "the work of an optimal control solve over the number of control intervals",
                    .fields = kControlGrowthFields,
                    .rows = {ControlGrowth::kKind},
                    .times = Times::in_rows,
                    .run = run_control_growth,
                    .show = show_control_growth,
                    .unexpected_failures = control_growth_unexpected_failures});

}  // namespace
}  // namespace ricochet
