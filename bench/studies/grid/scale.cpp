#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/problem_choice.h"
#include "bench/measure/setting_kind.h"
#include "bench/measure/timing.h"
#include "bench/rows/progress.h"
#include "bench/studies/grid/scale_rows.h"
#include "bench/studies/study.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Of the size of q: time stepping lets contacts sink a little, and flying ones are farther.
constexpr double kTouches = 1e-4;

// Runs up to this CPU time [s] are repeated, longer ones are timed once.
constexpr double kRepeated = 2;

/// A run that is to be made, and what is needed to time it again.
struct Planned {
  ScaleRun run;
  std::string problem;
  ParameterChanges changes;
  double seconds = 0;             ///< of the first solve
  std::function<double()> again;  ///< of a run that is repeated
};

/// One scene of growing size and one method.
using Curve = std::vector<Planned>;

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
        Planned next;
        next.problem = problem;
        next.changes = group.value("set", ParameterChanges());
        for (const auto& [name, value] : group.value("set_per_n", ParameterChanges()))
          next.changes[name] = value * size;
        next.changes["n"] = size;
        const ProblemChoice choice{.problem = problem, .parameters = next.changes};
        next.run.scene = group.value("scene", problem);
        next.run.method = method;
        next.run.command = run_command(choice.arguments(), method, steps, 0);
        next.run.size = size;
        next.run.steps = steps;
        curve.push_back(std::move(next));
      }
      if (curve.empty()) throw InputError("sizes", "[]", "at least one is required");
      make_problem(problem, curve.front().changes);
      curves.push_back(std::move(curve));
    }
  }
  return curves;
}

void solve_once(const Settings& settings, bool with_times, Planned& planned) {
  ScaleRun& run = planned.run;
  const std::shared_ptr<const Problem> problem = make_problem(planned.problem, planned.changes);
  const std::shared_ptr<const Method> method = make_method(run.method);
  run.contacts = problem->n_c();
  if (const auto supported = method->can_run(problem->info()); !supported.ok) {
    run.status = "declined";
    run.message = supported.reason;
    return;
  }
  Solution solution;
  planned.seconds = seconds_of([&] { return method->solve(*problem, settings); }, solution);
  run.status = to_string(solution.status);
  if (with_times || solution.status != Status::time_limit) run.message = solution.message;  // it says how far it came
  if (!solution.succeeded()) return;
  const double steps = static_cast<double>(solution.counters.steps);
  run.step_seconds = planned.seconds / run.steps;
  run.active = static_cast<int>((problem->gap(solution.q).array() < kTouches).count());
  run.solves = static_cast<double>(solution.counters.complementarity_solves) / steps;
  run.iterations = static_cast<double>(solution.counters.inner_iterations + solution.counters.pivots) / steps;
  run.events = static_cast<int>(solution.counters.events);
  if (!with_times)
    run.step_seconds = std::numeric_limits<double>::quiet_NaN();
  else if (planned.seconds <= kRepeated)
    planned.again = [problem, method, settings] { return method->solve(*problem, settings).own_seconds; };
}

/// Behind a size that the method does not finish, larger ones say so; the times of the others are those of one session.
std::vector<ScaleRun> run_curve(Curve& curve, const Settings& settings, bool quick, bool with_times) {
  bool ended = true;
  std::vector<TimedRun> timed;
  for (Planned& planned : curve) {
    if (ended) {
      solve_once(settings, with_times, planned);
    } else {
      planned.run.status = "not run";
      planned.run.message = "a smaller one did not end";
    }
    ended = planned.run.succeeded();
    if (planned.again) timed.push_back({planned.run.command, planned.seconds, planned.again});
  }
  const auto timings = measure(timed, quick, [](double) {});
  auto timing = timings.begin();
  std::vector<ScaleRun> runs;
  for (Planned& planned : curve) {
    if (planned.again) planned.run.step_seconds = (timing++)->median / planned.run.steps;
    runs.push_back(planned.run);
  }
  return runs;
}

/// "steps"; "time_limit" of a run [s]; "runs": [{"problem", "scene": its name in the report, "set": {parameter: value},
/// "set_per_n": {parameter: value for n = 1}, "sizes": values of the parameter n, "methods"}]. A piece is a
/// curve: one that was interrupted is measured again.
void run_scale(const json& experiment, ResultsFile& file) {
  std::vector<Curve> curves = read_curves(experiment);
  Settings settings;
  settings.steps = experiment.at("steps");
  settings.time_limit = experiment.at("time_limit");
  settings.recording = Recording::final_state;  // n contacts that close at once would be n^2 numbers
  Progress progress(experiment.at("id").get<std::string>());
  const bool quick = experiment.value("quick", false), with_times = experiment.value("times", true);
  file.sessions<ScaleRun>(
      curves.size(), [&](std::size_t k) { return curves[k].size(); },
      [&](std::size_t k) { return run_curve(curves[k], settings, quick, with_times); },
      [&](std::size_t k) {
        progress.update(static_cast<double>(k + 1) / static_cast<double>(curves.size()), curves[k].front().run.command);
      });
}

void show_scale(const Results& results, Section& section) {
  const auto runs = results.all<ScaleRun>();
  if (std::ranges::any_of(runs, [](const ScaleRun& run) { return run.step_seconds > 0; }))
    section.chart(growth_chart(scale_curves(runs), results.experiment(), "Time of a step", "active contacts",
                               "microseconds per step", "steps"));
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
                                                 .rows = {ScaleRun::kKind},
                                                 .reads_quick = true,
                                                 .times = Times::in_rows,
                                                 .run = run_scale,
                                                 .show = show_scale,
                                                 .surprises = {}});

}  // namespace
}  // namespace ricochet
