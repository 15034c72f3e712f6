#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <random>

#include "bench/control/control_guess.h"
#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "bench/studies/control/mpc_rows.h"
#include "methods/control/shrinking_horizon.h"

namespace ricochet {
namespace {

using nlohmann::json;

MpcRun follow_plan(const std::string& arguments, double disturbance, double update_limit) {
  ControlOptions options = ControlOptions::parse(arguments);
  options.update_limit = update_limit;
  const auto problem = options.make_problem();
  const PreparedMethod method = prepared_method(options, *problem);
  ShrinkingHorizon horizon(*problem, *method.solver);
  const ControlSolution first = horizon.solve();

  MpcRun run;
  run.problem = problem->id;
  run.method = options.method;
  run.command = fmt::format("ricochet mpc {} --disturbance {} --update-limit {}", arguments, disturbance, update_limit);
  run.disturbance = disturbance;
  run.status = to_string(first.status);
  run.message = first.message;
  run.seconds = first.seconds;
  if (!first.has_plan()) return run;
  run.planned_cost = first.trajectory.objective;
  std::mt19937 random(options.exploration.seed);
  while (horizon.interval() < problem->n_intervals) {
    if (const Status plant = horizon.advance(); plant != Status::success) {
      run.status = fmt::format("plant: {}", to_string(plant));
      run.message = fmt::format("no motion in interval {}", horizon.interval() + 1);
      return run;
    }
    if (horizon.interval() == problem->n_intervals) break;
    if (disturbance > 0) horizon.disturb(disturbance, random);
    const ControlSolution again = horizon.resolve();
    run.updates.push_back({horizon.interval() * horizon.plan().T / problem->n_intervals, to_string(again.status),
                           again.message, again.has_plan(), again.kept_branch, again.iterations, again.seconds,
                           again.violation});
  }
  run.cost = horizon.cost_so_far() + horizon.terminal_cost();
  return run;
}

/// Removes everything that depends on the speed and load of the machine.
void leave_times_out(MpcRun& run) {
  run.seconds = std::numeric_limits<double>::quiet_NaN();
  for (auto& update : run.updates) update.seconds = run.seconds;
}

/// Model predictive control by both methods. "runs": [{"problem", "homotopy", "shooting"}], with the arguments of
/// `ricochet mpc`; each runs with each of "disturbances", one method after the other.
void run_control_mpc(const json& experiment, ResultsFile& file) {
  struct Piece {
    std::string arguments;
    double disturbance;
  };
  std::vector<Piece> pieces;
  for (const json& entry : experiment.at("runs")) {
    const std::string problem = entry.at("problem");
    const std::string of[] = {fmt::format("{} {}", problem, entry.at(kHomotopy).get<std::string>()),
                              fmt::format("{} --method shooting {}", problem, entry.at(kShooting).get<std::string>())};
    for (const auto& arguments : of) ControlOptions::parse(arguments).make_problem();  // bad ones throw here
    for (const double disturbance : experiment.at("disturbances")) {
      for (const auto& arguments : of) pieces.push_back({arguments, disturbance});
    }
  }
  if (experiment.contains("goals")) file.header()["goals"] = experiment["goals"];
  const double update_limit = experiment.value("update_limit", 0.0);
  const bool with_times = experiment.value("times", true);
  Progress progress(experiment.at("id").get<std::string>());
  const auto make = [&](std::size_t k) {
    MpcRun run = follow_plan(pieces[k].arguments, pieces[k].disturbance, update_limit);
    if (!with_times) leave_times_out(run);
    return run;
  };
  file.each<MpcRun>(pieces.size(), make, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(pieces.size()), pieces[k].arguments);
  });
}

void show_control_mpc(const Results& results, Section& section) {
  const auto runs = results.all<MpcRun>();
  section.result("runs", mpc_table(runs));
  if (const auto comparisons = mpc_comparisons(runs); !comparisons.empty())
    section.result("comparison", comparison_table(comparisons, results.header));
  if (std::ranges::any_of(runs, [](const MpcRun& run) { return run.seconds > 0; }))
    section.chart(mpc_chart(runs, results.experiment()));
  section.details("updates", mpc_updates(runs));
}

const std::string kControlMpcFields = std::string(R"~({
  "required": ["disturbances", "runs"],
  "properties": {
    )~") + kGoalsField + R"~(,
    "disturbances": {"type": "array", "items": {"type": "number", "minimum": 0}, "description": "Before every update positions are moved by up to this [m, rad], velocities by up to this part of them.", "examples": [[0.003]]},
    "update_limit": {"type": "number", "exclusiveMinimum": 0, "description": "Limit of the wall time of an update [s]; without it there is none.", "examples": [20]},
    "runs": {"type": "array", "description": "Problems.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "homotopy", "shooting"], "properties": {
        "problem": {"type": "string", "description": "Of `ricochet mpc`.", "examples": ["two_carts"]},
        "homotopy": {"type": "string", "description": "Arguments of `ricochet mpc` with the homotopy.", "examples": ["--simulate --sigma-0 0.01"]},
        "shooting": {"type": "string", "description": "Those of --method shooting.", "examples": ["--explore 12"]}}}}
  }
})~";

// A homotopy may find no plan: the tables say so.
const bool control_mpc_is_registered =
    register_study({.kind = "control_mpc",
                    .summary = "model predictive control by homotopy and shooting: time of a second solve, plans, cost",
                    .fields = kControlMpcFields,
                    .rows = {MpcRun::kKind},
                    .times = Times::in_rows,
                    .run = run_control_mpc,
                    .show = show_control_mpc,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
