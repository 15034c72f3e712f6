#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/measure/allocations.h"
#include "bench/measure/measure_run.h"
#include "bench/rows/progress.h"
#include "bench/studies/grid/fastest_choice.h"
#include "bench/studies/grid/fastest_rows.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/performance_profile.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Runs of a family and a level that are measured: the quickest by first impression.
constexpr std::size_t kContenders = 4;

/// A method with all its settings.
struct Contender {
  std::string spec;
  std::shared_ptr<const Method> method;
  std::vector<Setting> settings;
};
struct Competitor {
  std::string name;
  std::vector<Contender> contenders;
};
struct Scene {
  std::string name, group;
  ProblemChoice choice;
};
struct Plan {
  std::vector<double> levels;
  std::vector<std::string> solvers;
  std::vector<Competitor> families;
  std::vector<Scene> scenes;
  double time_limit = 0;
  bool quick = false;
};

Plan read_plan(const json& experiment) {
  Plan plan;
  experiment.at("levels").get_to(plan.levels);
  plan.solvers = experiment.value("solvers", std::vector<std::string>{"new"});
  plan.time_limit = experiment.at("time_limit");
  plan.quick = experiment.value("quick", false);
  for (const json& entry : experiment.at("families")) {
    Competitor family{entry.at("name"), {}};
    std::set<std::string> unused{"steps", "tolerances"};
    for (const std::string spec : entry.at("methods")) {
      Contender contender{spec, make_method(spec), {}};
      const std::string field = setting_of(*contender.method, 1, 1).is_tolerance() ? "tolerances" : "steps";
      if (!entry.contains(field))
        throw InputError("families." + family.name + ": " + spec, "no " + field, "they are required");
      unused.erase(field);
      for (const double value : logarithmic_grid(entry[field], field))
        contender.settings.push_back(setting_of(*contender.method, static_cast<int>(std::lround(value)), value));
      family.contenders.push_back(std::move(contender));
    }
    for (const auto& field : unused) {
      if (entry.contains(field))
        throw InputError(fmt::format("families.{}: {}: none of its methods takes them", family.name, field));
    }
    plan.families.push_back(std::move(family));
  }
  for (const json& entry : experiment.at("scenes")) {
    plan.scenes.push_back(
        {entry.value("name", entry.at("problem").get<std::string>()), entry.at("group"), read_problem_choice(entry)});
  }
  if (plan.families.empty() || plan.levels.empty())
    throw InputError("families, levels", "[]", "at least one of each is required");
  return plan;
}

/// A run that succeeded, and how it is timed.
struct Attempt {
  Run run;
  TimedRun timed;
};

/// All runs of a family on a scene. @param row  counts them, and has the reason of the last failure
std::vector<Attempt> attempts(const Competitor& family, const Scene& scene, const Measurement& measurement,
                              FastestRun& row) {
  std::vector<Attempt> list;
  double &tried = row.values["tried"], &failed = row.values["failed"];
  for (const Contender& contender : family.contenders) {
    std::shared_ptr<Solver> kept;
    if (row.solver() == "kept" && contender.method->can_run(measurement.problem.info()).ok)
      kept = contender.method->prepare(measurement.problem);
    for (const Setting& setting : contender.settings) {
      Run run = planned_run(scene.choice, contender.spec, setting);
      Solution solution;
      const double seconds =
          seconds_of([&] { return measure_run(measurement, *contender.method, run, kept.get()); }, solution);
      if (!run.succeeded()) row.message = run.message;
      if (run.status == "declined") break;
      ++tried;
      failed += run.failed();
      if (solution.status == Status::time_limit) break;
      if (run.succeeded()) list.push_back({run, timed_run(measurement, run, kept, seconds)});
    }
  }
  return list;
}

/// The few quickest of the attempts that reach a level, by first impression.
std::vector<const Attempt*> contenders_for(double level, const std::vector<Attempt>& list) {
  std::vector<const Attempt*> reach;
  for (const Attempt& a : list) {
    if (a.run.error <= level) reach.push_back(&a);
  }
  std::ranges::sort(reach, {}, [](const Attempt* a) { return a->timed.expected_seconds; });
  if (reach.size() > kContenders) reach.resize(kContenders);
  return reach;
}

/// Method, setting and result of a run, in a row that keeps its place in the study.
void take_result(const Run& run, FastestRun& row) {
  Run filled = run;
  filled.scene = row.scene;
  filled.group = row.group;
  filled.labels = row.labels;
  filled.conditions = row.conditions;
  filled.values = row.values;
  static_cast<Run&>(row) = std::move(filled);
}

/// The runs of every family that may be the fastest at a level, measured together.
std::vector<FastestRun> run_scene(const Plan& plan, const Scene& scene) {
  const auto problem = scene.choice.make_problem();
  const reference::Reference reference = scene.choice.make_reference(*problem);
  const Measurement measurement{
      .problem = *problem, .reference = &reference, .recording = Recording::final_state, .time_limit = plan.time_limit};
  std::vector<FastestRun> rows;                         // solver after solver, family after family, level after level
  std::vector<std::vector<const Attempt*>> contenders;  // by row
  std::list<std::vector<Attempt>> attempted;
  std::map<const Attempt*, std::size_t> timed_at;  // place among the timed runs
  std::vector<TimedRun> timed;
  const auto compete = [&](const Competitor& family, const std::string& solver) {
    FastestRun row;
    row.problem = scene.choice.problem;
    row.parameters = scene.choice.parameters;
    row.scene = scene.name;
    row.group = scene.group;
    row.labels = {{"family", family.name}, {"solver", solver}};
    row.status = "not_reached";
    row.reference_error = reference.uncertainty;
    row.solution_size = reference.size();
    const auto& list = attempted.emplace_back(attempts(family, scene, measurement, row));
    for (const double level : plan.levels) {
      row.conditions["level"] = level;
      rows.push_back(row);
      contenders.push_back(contenders_for(level, list));
      for (const Attempt* a : contenders.back()) {
        if (timed_at.try_emplace(a, timed.size()).second) timed.push_back(a->timed);
      }
    }
  };
  for (const auto& solver : plan.solvers) {
    for (const Competitor& family : plan.families) compete(family, solver);
  }
  const auto timings = time_runs(timed, plan.quick, [](double) {});
  const ReferenceMotion motion = reference_motion(*problem, reference);
  std::map<const Attempt*, Metrics> metrics;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto median = [&](const Attempt* a) { return timings[timed_at.at(a)].median; };
    const auto fastest = std::ranges::min_element(contenders[k], {}, median);
    if (fastest == contenders[k].end()) continue;
    const Run& run = (*fastest)->run;
    take_result(run, rows[k]);
    const auto place = timed_at.at(*fastest);
    rows[k].timing = timings[place];
    rows[k].peak_bytes = peak_bytes_of(timed[place].run);
    const auto [known, is_new] = metrics.try_emplace(*fastest);
    if (is_new)
      known->second = metrics_of_run(*make_method(run.method), *problem, Measurement{.problem = *problem}.settings(run),
                                     run.counters.steps, motion);
    rows[k].metrics = known->second;
  }
  return rows;
}

/// Fields of the experiment:
///   "levels"      errors to be reached
///   "solvers"     "new", "kept" (FastestRun::solver), by default ["new"]
///   "time_limit"  of a run [s]
///   "families"    [{"name", "methods", "steps" and "tolerances"}], the settings of every method: {"from", "to",
///                 "per_decade"}; all are compared with the first
///   "scenes"      [{"name", "group", and the fields of problem_choice.h}]
/// A piece is a scene, on which all families compete in one session.
void run_fastest(const json& experiment, ResultsFile& file) {
  const Plan plan = read_plan(experiment);
  Progress progress(experiment.at("id").get<std::string>());
  const std::size_t n = plan.scenes.size();
  file.sessions<FastestRun>(
      n, [&](std::size_t) { return plan.solvers.size() * plan.families.size() * plan.levels.size(); },
      [&](std::size_t k) { return run_scene(plan, plan.scenes[k]); },
      [&](std::size_t k) {
        progress.update(static_cast<double>(k + 1) / static_cast<double>(n), plan.scenes[k].name);
      });
}

/// Families against each other on all scenes whose reference can judge the level.
void add_profile(const std::vector<FastestRun>& runs, double level, const std::string& prefix, Section& section) {
  std::vector<std::string> scenes;
  for (const FastestRun& run : runs) {
    const bool is_known = std::ranges::find(scenes, run.scene) != scenes.end();
    if (run.level() == level && run.is_judged() && !is_known) scenes.push_back(run.scene);
  }
  if (scenes.empty()) return;
  const auto families = different(runs, &FastestRun::family);
  std::vector<std::vector<double>> times(families.size(), std::vector<double>(scenes.size(), HUGE_VAL));
  for (const FastestRun& run : runs) {
    if (run.level() != level || !run.is_judged() || !run.is_reached()) continue;
    const auto f = std::ranges::find(families, run.family()) - families.begin();
    const auto s = std::ranges::find(scenes, run.scene) - scenes.begin();
    times[static_cast<std::size_t>(f)][static_cast<std::size_t>(s)] = run.microseconds();
  }
  const PerformanceProfile profile(families, times);
  const std::string& solver = runs.front().solver();
  const std::string name = fmt::format("profile_{}_{:.0e}", solver, level),
                    title = fmt::format("Performance profiles, error at most {:.0e}{}", level,
                                        solver == "new" ? "" : ", " + solver + " solvers");
  profile.show(
      section, name, title,
      fmt::format("Share of {} scenes on which the fastest run of a family takes at most tau times that of the best "
                  "family; one that does not reach the error takes infinitely long (Dolan, Moré 2002).",
                  scenes.size()),
      fmt::format("{}_profile_{:.0e}", prefix, level));
}

void show_fastest(const Results& results, Section& section) {
  const auto runs = results.all<FastestRun>();
  for (const auto& solver : different(runs, &FastestRun::solver)) {
    const auto part = runs_of_solver(runs, solver);
    const std::string suffix = solver == "new" ? "" : "_" + solver;
    if (solver == "new")
      section.choice("choice", which_to_take(part), choice_data(part));
    else
      section.result("choice" + suffix, which_to_take(part));
    section.result("ratios" + suffix, ratio_table(part));
    section.result("fastest" + suffix, fastest_table(part));
    for (const double level : different(part, &FastestRun::level))
      add_profile(part, level, results.experiment() + suffix, section);
  }
  section.details("choices", choice_table(runs));
  show_metrics(measured_runs(runs), section);
  section.failures("unreached", unreached_table(runs));
}

constexpr const char* kFastestFields = R"~({
  "required": ["levels", "families", "scenes", "time_limit"],
  "properties": {
    "levels": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Errors to be reached.", "examples": [[1e-3, 1e-6]]},
    "solvers": {"type": "array", "minItems": 1, "items": {"enum": ["new", "kept"]}, "description": "Made for each run, or kept between the runs of a scene where a method can; each is a competition of its own.", "default": ["new"], "examples": [["new", "kept"]]},
    "families": {"type": "array", "minItems": 1, "description": "Methods that compete as one.", "items": {
      "type": "object", "additionalProperties": false, "required": ["name", "methods"], "properties": {
        "name": {"type": "string", "description": "In tables.", "examples": ["FESD-J"]},
        "methods": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}, "description": "Its methods.", "examples": [["fesd:gauss:4"]]},
        "steps": {"$ref": "#/$defs/range", "description": "Of its fixed-step methods.", "examples": [{"from": 5, "to": 500, "per_decade": 4}]},
        "tolerances": {"$ref": "#/$defs/range", "description": "Of its error-controlled methods.", "examples": [{"from": 0.01, "to": 1e-12, "per_decade": 1}]}}}},
    "scenes": {"type": "array", "description": "Where they compete.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "group"], "properties": {
        "name": {"type": "string", "description": "In tables; the problem without it.", "examples": ["a row of 4"]},
        "group": {"type": "string", "description": "Of scenes that are shown together.", "examples": ["rows"]},
        "problem": {"$ref": "#/$defs/problem", "examples": ["bead_row"]},
        "parameters": {"$ref": "#/$defs/parameters", "examples": [{"n": 4}]}}}}
  }
})~";

// The study shows which levels a family does not reach, so that none of them is unexpected.
const bool fastest_is_registered =
    register_study({.kind = "fastest",
                    .summary = "the fastest run of each family of methods that reaches an error, scene by scene",
                    .fields = kFastestFields,
                    .rows = {Run::kKind},
                    .reads_quick = true,
                    .times = Times::always,
                    .run = run_fastest,
                    .show = show_fastest,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
