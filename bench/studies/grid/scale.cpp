#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/measure/measure_run.h"
#include "bench/rows/progress.h"
#include "bench/studies/grid/scale_rows.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Gap of a touching contact, relative to the size of q: time stepping lets contacts sink a little; open ones are farther.
constexpr double kTouches = 1e-4;

// Runs up to this CPU time [s] are repeated, longer ones are timed once.
constexpr double kRepeated = 2;

/// Runs of one method on one scene of growing size.
using Curve = std::vector<Run>;

std::vector<Curve> read_curves(const json& document) {
  const int steps = document.at("steps");
  if (steps < 1) throw InputError("steps", steps, "a number >= 1 is required");
  std::vector<Curve> curves;
  for (const json& group : document.at("runs")) {
    const std::string problem = group.at("problem");
    for (const std::string method : group.at("methods")) {
      require_kind_of_setting(*make_method(method), "steps", "");
      Curve curve;
      for (const int size : group.at("sizes")) {
        ProblemChoice choice{.problem = problem, .parameters = group.value("set", ParameterChanges())};
        for (const auto& [name, value] : group.value("set_per_n", ParameterChanges()))
          choice.parameters[name] = value * size;
        choice.parameters["n"] = size;
        Run& run = curve.emplace_back(planned_run(choice, method, {.steps = steps}));
        run.scene = group.value("scene", problem);
      }
      if (curve.empty()) throw InputError("sizes", "[]", "at least one is required");
      make_problem(problem, curve.front().parameters);
      curves.push_back(std::move(curve));
    }
  }
  return curves;
}

/// The contacts of a run and the work of its contact solver.
void add_values(const Problem& problem, const Solution& solution, Run& run) {
  run.values["contacts"] = problem.n_c();
  if (!run.succeeded()) return;
  const auto steps = static_cast<double>(run.counters.steps);
  run.values["active"] = static_cast<double>((problem.gap(solution.q).array() < kTouches).count());
  run.values["solves"] = static_cast<double>(run.counters.complementarity_solves) / steps;
  run.values["iterations"] = static_cast<double>(run.counters.inner_iterations + run.counters.pivots) / steps;
}

/// Runs a curve and times it in one session. After a size that the method does not finish, larger ones are not run.
std::vector<Run> run_curve(const Curve& curve, double time_limit, bool quick, bool with_times) {
  std::vector<Run> runs = curve;
  std::vector<std::unique_ptr<Problem>> problems;
  std::vector<TimedRun> timed;
  std::vector<Run*> timed_runs;
  for (Run& run : runs) {
    if (&run != &runs.front() && !(&run - 1)->succeeded()) {
      run.status = "not_run";
      run.message = "a smaller one did not end";
      continue;
    }
    const Problem& problem = *problems.emplace_back(make_problem(run.problem, run.parameters));
    // n contacts that close at once would be n^2 numbers in the events.
    const Measurement measurement{.problem = problem, .recording = Recording::final_state, .time_limit = time_limit};
    Solution solution;
    const double seconds = seconds_of([&] { return measure_run(measurement, run); }, solution);
    if (!with_times && solution.status == Status::time_limit) run.message.clear();  // it contains how far the run came
    add_values(problem, solution, run);
    if (!run.succeeded() || !with_times) continue;
    run.timing = {seconds, seconds, seconds, seconds, 1};
    if (seconds > kRepeated) continue;
    timed.push_back(timed_run(measurement, run, nullptr, seconds));
    timed_runs.push_back(&run);
  }
  const auto timings = time_runs(timed, quick, [](double) {});
  for (std::size_t k = 0; k < timings.size(); ++k) timed_runs[k]->timing = timings[k];
  return runs;
}

/// "steps"; "time_limit" of a run [s]; "runs": [{"problem", "scene": its name in the report, "set": {parameter: value},
/// "set_per_n": {parameter: value for n = 1}, "sizes": values of the parameter n, "methods"}]. A piece is a
/// curve: one that was interrupted is measured again.
void run_scale(const json& experiment, ResultsFile& file) {
  const std::vector<Curve> curves = read_curves(experiment);
  const double time_limit = experiment.at("time_limit");
  Progress progress(experiment.at("id").get<std::string>());
  const bool quick = experiment.value("quick", false), with_times = experiment.value("times", true);
  file.sessions<Run>(
      curves.size(), [&](std::size_t k) { return curves[k].size(); },
      [&](std::size_t k) { return run_curve(curves[k], time_limit, quick, with_times); },
      [&](std::size_t k) {
        progress.update(static_cast<double>(k + 1) / static_cast<double>(curves.size()), curves[k].front().command());
      });
}

void show_scale(const Results& results, Section& section) {
  const auto runs = results.all<Run>();
  if (std::ranges::any_of(runs, &Run::has_time))
    section.chart(growth_chart(scale_curves(runs), results.experiment(), "Time of a step", "active contacts",
                               "microseconds per step"));
  section.result("steps", scale_table(runs));
  section.failures("failures", scale_failures(runs));
}

constexpr const char* kScaleFields = R"~({
  "required": ["steps", "runs"],
  "properties": {
    "steps": {"type": "integer", "minimum": 1, "description": "Of every run.", "examples": [100]},
    "runs": {"type": "array", "description": "Scenes of growing size.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "sizes", "methods"], "properties": {
        "problem": {"type": "string", "description": "A scene of `ricochet list problems` with a parameter n.", "examples": ["bead_row"]},
        "scene": {"type": "string", "description": "In tables; the problem without it.", "examples": ["bead_row, at rest"]},
        "set": {"type": "object", "additionalProperties": {"type": "number"}, "description": "Parameters.", "examples": [{"speed": 0}]},
        "set_per_n": {"type": "object", "additionalProperties": {"type": "number"}, "description": "Parameters that are multiplied by n.", "examples": [{"speed": 0.06}]},
        "sizes": {"type": "array", "minItems": 1, "items": {"type": "integer", "minimum": 1}, "description": "n of the scenes.", "examples": [[8, 32]]},
        "methods": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}, "description": "Fixed-step methods.", "examples": [["moreau_jean"]]}}}}
  }
})~";

// A method that declines, or does not finish a large scene in time, is what the study is about.
const bool scale_is_registered = register_study({.kind = "scale",
                                                 .summary = "the time of a step on scenes of growing size",
                                                 .fields = kScaleFields,
                                                 .rows = {Run::kKind},
                                                 .reads_quick = true,
                                                 .times = Times::in_rows,
                                                 .run = run_scale,
                                                 .show = show_scale,
                                                 .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
