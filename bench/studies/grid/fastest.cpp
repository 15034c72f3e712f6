#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/allocations.h"
#include "bench/measure/metrics/metrics.h"
#include "bench/measure/problem_choice.h"
#include "bench/measure/timing.h"
#include "bench/rows/progress.h"
#include "bench/studies/grid/fastest_choice.h"
#include "bench/studies/grid/fastest_rows.h"
#include "bench/studies/study.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/performance_profile.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Runs of a family and a level that are measured: the quickest by first impression.
constexpr std::size_t kContenders = 4;
constexpr int kFirstImpressions = 3;

/// A method with all its settings.
struct Contender {
  std::shared_ptr<const Method> method;
  std::vector<Settings> settings;
};
struct Family {
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
  std::vector<Family> families;
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
    Family family{entry.at("name"), {}};
    for (const std::string spec : entry.at("methods")) {
      Contender contender{make_method(spec), {}};
      const bool is_adaptive = contender.method->info().is_adaptive;
      const std::string field = is_adaptive ? "tolerances" : "steps";
      if (!entry.contains(field))
        throw InputError("families." + family.name + ": " + spec, "no " + field, "they are required");
      for (const double value : logarithmic_grid(entry[field], field)) {
        Settings settings;
        settings.time_limit = plan.time_limit;
        settings.recording = Recording::final_state;
        if (is_adaptive)
          settings.tolerance = value;
        else
          settings.steps = static_cast<int>(std::lround(value));
        contender.settings.push_back(settings);
      }
      family.contenders.push_back(std::move(contender));
    }
    for (const char* field : {"steps", "tolerances"}) {
      const auto takes_it = [&](const Contender& c) {
        return c.method->info().is_adaptive == (field == std::string("tolerances"));
      };
      if (entry.contains(field) && std::ranges::none_of(family.contenders, takes_it))
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

/// A run that succeeded.
struct Attempt {
  const Contender* contender;
  Settings settings;
  std::function<Solution()> run;
  double error = 0, seconds = 0;
  std::int64_t steps = 0;  ///< that it took
};

/// All runs of a family on a scene, with a first impression of their time.
std::vector<Attempt> attempts(const Family& family, const Problem& problem, const reference::Reference& reference,
                              FastestRun& row) {
  std::vector<Attempt> list;
  for (const Contender& contender : family.contenders) {
    if (const auto supported = contender.method->can_run(problem.info()); !supported.ok) {
      row.why = supported.reason;
      continue;
    }
    std::shared_ptr<Solver> kept;
    if (row.solver == "kept") kept = contender.method->prepare(problem);
    for (const Settings& settings : contender.settings) {
      ++row.tried;
      const std::function<Solution()> run = [&problem, &contender, &settings, kept] {
        return kept ? kept->solve(settings) : contender.method->solve(problem, settings);
      };
      Solution solution;
      double seconds = seconds_of(run, solution);
      if (!solution.succeeded()) {
        ++row.failed;
        row.why = solution.message;
        if (solution.status == Status::time_limit) break;
        continue;
      }
      for (int k = 1; k < kFirstImpressions && seconds < 0.05; ++k)
        seconds = std::min(seconds, seconds_of(run, solution));
      list.push_back({&contender, settings, run, reference.error_of(solution), seconds, solution.counters.steps});
    }
  }
  return list;
}

/// The few quickest of the attempts that reach a level, by first impression.
std::vector<const Attempt*> contenders_for(double level, const std::vector<Attempt>& list) {
  std::vector<const Attempt*> reach;
  for (const Attempt& a : list) {
    if (a.error <= level) reach.push_back(&a);
  }
  std::ranges::sort(reach, {}, &Attempt::seconds);
  if (reach.size() > kContenders) reach.resize(kContenders);
  return reach;
}

void write(const Attempt& attempt, const Timing& timing, const ProblemChoice& choice, FastestRun& row) {
  const Settings& settings = attempt.settings;
  row.method = attempt.contender->method->info().id;
  row.setting = setting_text(settings.steps, settings.tolerance);
  row.command = run_command(choice.arguments(), row.method, settings.steps, settings.tolerance);
  row.error = attempt.error;
  row.microseconds = 1e6 * timing.median;
  row.lower_quartile = 1e6 * timing.lower_quartile;
  row.upper_quartile = 1e6 * timing.upper_quartile;
}

/// Looks at the motions of runs, of each once.
class Looker {
 public:
  Looker(const Problem& problem, const reference::Reference& reference)
      : problem_(problem), truth_(reference_motion(problem, reference)) {}

  Metrics at(const Attempt& attempt) {
    const Method& method = *attempt.contender->method;
    const Settings& settings = attempt.settings;
    const auto [known, is_new] =
        known_.try_emplace({method.info().id, setting_text(settings.steps, settings.tolerance)});
    if (is_new) {
      Settings repeated = settings;
      repeated.time_limit = 0;
      known->second = metrics_of_run(method, problem_, repeated, attempt.steps, truth_);
    }
    return known->second;
  }

 private:
  const Problem& problem_;
  const ReferenceMotion truth_;
  std::map<std::pair<std::string, std::string>, Metrics> known_;
};

/// The runs of every family that may be the fastest at a level, measured together.
std::vector<FastestRun> run_scene(const Plan& plan, const Scene& scene) {
  const auto problem = scene.choice.make_problem();
  const reference::Reference reference = scene.choice.make_reference(*problem);
  std::vector<FastestRun> rows;                         // solver after solver, family after family, level after level
  std::vector<std::vector<const Attempt*>> contenders;  // by row
  std::list<std::vector<Attempt>> attempted;
  std::map<const Attempt*, std::size_t> measured;  // its number among the timed runs
  std::vector<TimedRun> timed;
  const auto compete = [&](const Family& family, const std::string& solver) {
    FastestRun row;
    row.scene = scene.name;
    row.problem = scene.choice.problem;
    row.group = scene.group;
    row.family = family.name;
    row.solver = solver;
    row.uncertainty = reference.uncertainty;
    const auto& list = attempted.emplace_back(attempts(family, *problem, reference, row));
    for (const double level : plan.levels) {
      row.level = level;
      rows.push_back(row);
      contenders.push_back(contenders_for(level, list));
      for (const Attempt* a : contenders.back()) {
        if (measured.try_emplace(a, timed.size()).second)
          timed.push_back({"", a->seconds, [a] { return a->run().own_seconds; }});
      }
    }
  };
  for (const auto& solver : plan.solvers) {
    for (const Family& family : plan.families) compete(family, solver);
  }
  const auto timings = measure(timed, plan.quick, [](double) {});
  Looker look(*problem, reference);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto median = [&](const Attempt* a) { return timings[measured.at(a)].median; };
    const auto fastest = std::ranges::min_element(contenders[k], {}, median);
    if (fastest == contenders[k].end()) continue;
    write(**fastest, timings[measured.at(*fastest)], scene.choice, rows[k]);
    rows[k].metrics = look.at(**fastest);
    rows[k].peak_bytes = peak_bytes_of(timed[measured.at(*fastest)].run);
    rows[k].solution_size = reference.size();
  }
  return rows;
}

/// "levels": errors; "solvers": "new", "kept" (FastestRun::solver), ["new"] without it; "time_limit" of a run [s]; "families": [{"name", "methods", "steps" and "tolerances", the settings
/// of every method: {"from", "to", "per_decade"}}], the first is what the others are compared with; "scenes": [{"name",
/// "group", and the fields of problem_choice.h}]. A piece is a scene, on which all families compete in one session.
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
    if (run.level == level && run.is_judged() && !is_known) scenes.push_back(run.scene);
  }
  if (scenes.empty()) return;
  const auto families = different(runs, &FastestRun::family);
  std::vector<std::vector<double>> times(families.size(), std::vector<double>(scenes.size(), HUGE_VAL));
  for (const FastestRun& run : runs) {
    if (run.level != level || !run.is_judged() || !run.is_reached()) continue;
    const auto f = std::ranges::find(families, run.family) - families.begin();
    const auto s = std::ranges::find(scenes, run.scene) - scenes.begin();
    times[static_cast<std::size_t>(f)][static_cast<std::size_t>(s)] = run.microseconds;
  }
  const PerformanceProfile profile(families, times);
  const std::string& solver = runs.front().solver;
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

// That a family does not reach a level on some scene is what the study is about.
const bool fastest_is_registered =
    register_study({.kind = "fastest",
                    .summary = "the fastest run of each family of methods that reaches an error, scene by scene",
                    .fields = kFastestFields,
                    .rows = {FastestRun::kKind},
                    .reads_quick = true,
                    .times = Times::always,
                    .run = run_fastest,
                    .show = show_fastest,
                    .surprises = {}});

}  // namespace
}  // namespace ricochet
