#include "bench/studies/grid/grid_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/measure_run.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// A grid: numbers of steps, or {"from", "to", "per_decade"} for a logarithmic one, or the name of a grid, or a list of
/// those.
std::vector<int> read_steps(const json& value, const json& grids, const std::string& field) {
  std::vector<int> steps;
  if (value.is_string()) {
    const std::string name = value;
    if (!grids.contains(name))
      throw_unknown_name("grid in " + field, name, keys_of(grids.get<std::map<std::string, json>>()));
    steps = read_steps(grids[name], grids, field);
  } else if (value.is_array()) {
    for (const auto& entry : value) {
      const auto part = entry.is_number() ? std::vector<int>{entry.get<int>()} : read_steps(entry, grids, field);
      steps.insert(steps.end(), part.begin(), part.end());
    }
  } else {
    for (const double n : logarithmic_grid(value, field)) steps.push_back(static_cast<int>(std::lround(n)));
  }
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  if (steps.empty() || steps.front() < 1) throw InputError(field, value.dump(), "numbers of steps >= 1 are required");
  return steps;
}

GridExperiment::MethodGrid read_method_grid(const json& entry, const json& grids) {
  GridExperiment::MethodGrid grid;
  grid.method = entry.at("method");
  grid.on_failure = entry.value("on_failure", "");
  grid.may_fail = entry.value("may_fail", "");
  if (entry.contains("steps")) grid.steps = read_steps(entry["steps"], grids, "steps of " + grid.method);
  grid.tolerances = entry.value("tolerances", grid.tolerances);
  const auto require_setting = [&](const std::string& method, const std::string& place) {
    if (!method.empty() && reason_not_built(method).empty())
      require_kind_of_setting(*make_method(method), grid.steps.empty() ? "" : place + "steps",
                              grid.tolerances.empty() ? "" : place + "tolerances");
  };
  require_setting(grid.method, "methods: ");
  require_setting(grid.on_failure, "methods: on_failure with ");
  if (grid.steps.empty() && grid.tolerances.empty())
    throw InputError("methods", grid.method,
                     "\"steps\" of a fixed-step method or \"tolerances\" of an error-controlled one are required");
  return grid;
}

}  // namespace

GridExperiment read_grid_experiment(const json& document) {
  GridExperiment experiment;
  experiment.id = document.at("id");
  experiment.problem = read_problem_choice(document);
  experiment.needs_reference = !document.contains("reference") || !document["reference"].is_null();
  experiment.sensitivities = document.value("sensitivities", experiment.sensitivities);
  if (!experiment.sensitivities.empty() && !experiment.problem.truth())
    throw InputError("sensitivities", document["sensitivities"].dump(),
                     "a problem with a solution known to many digits is required");
  const json grids = document.value("grids", json::object());
  for (const auto& entry : document.at("methods")) experiment.methods.push_back(read_method_grid(entry, grids));
  if (document.contains("trajectory")) {
    experiment.trajectory_method = document["trajectory"].at("method");
    experiment.trajectory_steps = document["trajectory"].at("steps");
    if (reason_not_built(experiment.trajectory_method).empty())
      require_kind_of_setting(*make_method(experiment.trajectory_method), "trajectory: steps", "");
  }
  experiment.overhead_of = document.value("overhead_of", experiment.overhead_of);
  experiment.with_metrics = document.value("metrics", experiment.sensitivities.empty());
  experiment.with_times = document.value("times", true);
  experiment.quick = document.value("quick", false);
  experiment.time_limit = document.value("time_limit", experiment.time_limit);
  return experiment;
}

}  // namespace ricochet
