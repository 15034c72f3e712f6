#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <thread>

#include "bench/ensemble/ensemble.h"
#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/measure/measure_run.h"
#include "bench/measure/timing.h"
#include "bench/rows/in_order.h"
#include "bench/rows/progress.h"
#include "bench/studies/throughput/throughput_rows.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reference/agreement.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

using nlohmann::json;

// A run at the edge of an impact may have any error with any method: a part of an ensemble is judged.
constexpr double kPartWithin = 0.9;
// Costlier settings than this are not tried.
constexpr double kMostMicroseconds = 3e5;
// A setting that reaches the least error and costs this many times the cheapest one ends the search: later ones cost
// even more.
constexpr double kClearlyCostlier = 1.5;
// Numbers of runs in a measurement: with fewer, threads wait for the last one.
constexpr double kFewestRunsMeasured = 64, kMostRunsMeasured = 1e6;

struct ThroughputPlan {
  struct MethodGrid {
    std::string method, field;   ///< "steps" or "tolerance"
    std::vector<double> values;  ///< from cheap to costly
  };
  struct Scene {
    std::string name;
    json ensemble;  ///< all but method and setting
  };
  std::vector<double> levels;
  std::vector<MethodGrid> methods;
  MethodGrid reference, check;
  std::vector<Scene> scenes;
  std::vector<int> threads;
  int pilot_runs = 0, repetitions = 0;
  double seconds = 0;
};

/// 1, 2, 4, ... up to all that the machine has.
std::vector<int> all_threads() {
  const int most = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<int> list;
  for (int n = 1; n < most; n *= 2) list.push_back(n);
  list.push_back(most);
  return list;
}

ThroughputPlan::MethodGrid read_method(const json& entry, const std::string& place) {
  require_kind_of_setting(*make_method(entry.at("method")), entry.contains("steps") ? place + ": steps" : "",
                          entry.contains("tolerance") || entry.contains("tolerances") ? place + ": tolerances" : "");
  ThroughputPlan::MethodGrid grid{entry.at("method"), entry.contains("steps") ? "steps" : "tolerance", {}};
  if (entry.contains("tolerance"))
    grid.values = {entry["tolerance"].get<double>()};
  else
    grid.values = logarithmic_grid(entry.at(entry.contains("steps") ? "steps" : "tolerances"), place);
  return grid;
}

ThroughputPlan read_throughput_plan(const json& experiment) {
  ThroughputPlan plan;
  experiment.at("levels").get_to(plan.levels);
  for (const json& entry : experiment.at("methods")) plan.methods.push_back(read_method(entry, "methods"));
  plan.reference = read_method(experiment.at("reference"), "reference");
  plan.check = read_method(experiment.at("check"), "check");
  for (const json& entry : experiment.at("scenes")) {
    json ensemble = entry;
    ensemble.erase("name");
    ensemble["seed"] = experiment.value("seed", 1);
    plan.scenes.push_back({entry.value("name", entry.at("problem").get<std::string>()), ensemble});
  }
  plan.threads = experiment.value("threads", all_threads());
  experiment.at("pilot_runs").get_to(plan.pilot_runs);
  experiment.at("repetitions").get_to(plan.repetitions);
  experiment.at("seconds").get_to(plan.seconds);
  const auto require = [](bool ok, const char* field, double value, const char* allowed) {
    if (!ok) throw InputError(field, value, allowed);
  };
  require(plan.pilot_runs >= 10, "pilot_runs", plan.pilot_runs, "a number >= 10 is required");
  require(plan.repetitions >= 1, "repetitions", plan.repetitions, "a number >= 1 is required");
  require(plan.seconds > 0, "seconds", plan.seconds, "a number > 0 is required");
  for (const int n : plan.threads) require(n >= 1, "threads", n, "numbers >= 1 are required");
  for (const double level : plan.levels) require(level > 0, "levels", level, "numbers > 0 are required");
  if (plan.levels.empty() || plan.methods.empty() || plan.threads.empty())
    throw InputError("levels, methods, threads", "[]", "at least one of each is required");
  return plan;
}

Ensemble ensemble_of(const ThroughputPlan::Scene& scene, const ThroughputPlan::MethodGrid& grid, double value,
                     std::int64_t runs) {
  json document = scene.ensemble;
  document["method"] = grid.method;
  document["runs"] = runs;
  if (grid.field == "steps")
    document["steps"] = static_cast<int>(std::lround(value));
  else
    document["tolerance"] = value;
  return read_ensemble(document);
}

std::vector<EnsembleRun> first_runs(EnsembleWorker& worker, int n) {
  std::vector<EnsembleRun> runs;
  for (int k = 0; k < n; ++k) runs.push_back(worker.run(k));
  return runs;
}

double difference(const EnsembleRun& a, const EnsembleRun& b) {
  return reference::final_state_difference(a.q, a.v, b.q, b.v);
}

/// The first runs of a scene by the reference, and how well they are known.
struct Pilot {
  std::vector<EnsembleRun> runs;
  std::vector<char> is_judged;
  int judged = 0;
  double uncertainty = 0;
};

Pilot make_pilot(const ThroughputPlan& plan, const ThroughputPlan::Scene& scene) {
  const auto runs_of = [&](const ThroughputPlan::MethodGrid& grid) {
    const Ensemble ensemble = ensemble_of(scene, grid, grid.values.front(), plan.pilot_runs);
    EnsembleWorker worker(ensemble);
    return first_runs(worker, plan.pilot_runs);
  };
  Pilot pilot;
  pilot.runs = runs_of(plan.reference);
  const auto check = runs_of(plan.check);
  std::vector<double> differences;
  for (std::size_t k = 0; k < check.size(); ++k) {
    pilot.is_judged.push_back(pilot.runs[k].succeeded() && check[k].succeeded());
    if (pilot.is_judged.back()) differences.push_back(difference(pilot.runs[k], check[k]));
  }
  pilot.judged = static_cast<int>(differences.size());
  pilot.uncertainty = quantile(differences, kPartWithin);
  return pilot;
}

/// Error and cost of one setting on the pilot's runs.
ThroughputSetting try_setting(EnsembleWorker& worker, const Pilot& pilot, std::string& why) {
  const double begin = cpu_seconds();
  const auto runs = first_runs(worker, static_cast<int>(pilot.runs.size()));
  const double seconds = cpu_seconds() - begin;
  std::vector<double> errors;
  int failed = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (!pilot.is_judged[k]) continue;
    if (!runs[k].succeeded()) {
      why = runs[k].message;
      ++failed;
    }
    errors.push_back(runs[k].succeeded() ? difference(runs[k], pilot.runs[k]) : HUGE_VAL);
  }
  return {.error = quantile(errors, kPartWithin),
          .failed = failed / static_cast<double>(std::max<std::size_t>(1, errors.size())),
          .microseconds = 1e6 * seconds / static_cast<double>(runs.size())};
}

ThroughputCurve measure_curve(const ThroughputPlan& plan, const ThroughputPlan::Scene& scene,
                              const ThroughputPlan::MethodGrid& grid, const Pilot& pilot) {
  ThroughputCurve curve;
  curve.scene = scene.name;
  curve.method = grid.method;
  curve.uncertainty = pilot.uncertainty;
  curve.judged = pilot.judged;
  const double least = *std::ranges::min_element(plan.levels);
  double cheapest = HUGE_VAL;  // of the settings that reach it: short steps may cost less than long ones
  for (const double value : grid.values) {
    const Ensemble ensemble = ensemble_of(scene, grid, value, plan.pilot_runs);
    const double begin = cpu_seconds();
    std::unique_ptr<EnsembleWorker> worker;
    try {
      worker = std::make_unique<EnsembleWorker>(ensemble);
    } catch (const InputError& error) {  // the method declines the scene
      curve.why = error.what();
      break;
    }
    curve.make_microseconds = 1e6 * (cpu_seconds() - begin);
    ThroughputSetting setting = try_setting(*worker, pilot, curve.why);
    setting.steps = ensemble.settings.steps;
    setting.tolerance = ensemble.settings.tolerance;
    curve.settings.push_back(setting);
    if (curve.set_microseconds == 0) {
      const double start = cpu_seconds();
      for (int k = 0; k < plan.pilot_runs; ++k) worker->problem(k);
      curve.set_microseconds = 1e6 * (cpu_seconds() - start) / plan.pilot_runs;
    }
    if (setting.microseconds > kMostMicroseconds) break;
    if (!(setting.error <= least)) continue;
    if (setting.microseconds > kClearlyCostlier * cheapest) break;
    cheapest = std::min(cheapest, setting.microseconds);
  }
  return curve;
}

/// The cheapest setting that reaches a level; null where none does.
const ThroughputSetting* setting_for(const ThroughputCurve& curve, double level) {
  const ThroughputSetting* best = nullptr;
  for (const auto& setting : curve.settings) {
    if (setting.error <= level && (!best || setting.microseconds < best->microseconds)) best = &setting;
  }
  return best;
}

struct Spent {
  double wall = 0, cpu = 0;
};

Spent spent_by_threads(std::vector<std::unique_ptr<EnsembleWorker>>& workers, int threads, std::int64_t runs) {
  std::size_t bytes = 0;
  const double cpu = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  in_order(
      threads, 0, runs,
      [&](int thread, std::int64_t from, std::int64_t to) {
        return workers[static_cast<std::size_t>(thread)]->csv_lines(from, to);
      },
      [&](std::int64_t, const std::string& lines) { bytes += lines.size(); });
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (bytes == 0) throw std::logic_error("an ensemble without lines");
  return {wall, cpu_seconds() - cpu};
}

/// The same work by processes of one thread each, which share neither memory nor an allocator.
Spent spent_by_processes(EnsembleWorker& worker, int processes, std::int64_t runs) {
  Spent spent;
  const auto begin = std::chrono::steady_clock::now();
  std::vector<pid_t> children;
  for (int k = 0; k < processes; ++k) {
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("the system gives no process");
    if (child == 0) {
      std::size_t bytes = 0;
      try {
        in_order(
            1, runs * k / processes, runs * (k + 1) / processes,
            [&](int, std::int64_t from, std::int64_t to) { return worker.csv_lines(from, to); },
            [&](std::int64_t, const std::string& lines) { bytes += lines.size(); });
      } catch (...) {  // the child must not go on as if it were this program
        _exit(1);
      }
      _exit(bytes > 0 ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    rusage usage{};
    if (wait4(child, &status, 0, &usage) != child || status != 0) throw std::runtime_error("a process of runs failed");
    for (const timeval& part : {usage.ru_utime, usage.ru_stime})
      spent.cpu += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
  }
  spent.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return spent;
}

std::string command_of(const Ensemble& ensemble, const ThroughputSetting& setting, int threads) {
  std::string text = fmt::format("ricochet ensemble -p {}", ensemble.problem.problem);
  for (const auto& [name, value] : ensemble.problem.parameters) text += fmt::format(" --set {}={}", name, value);
  for (const auto& quantity : ensemble.varied) text += " --vary " + quantity.text();
  return text + fmt::format(" --runs {} --seed {} -m {} {} --threads {} -o out/runs.csv", ensemble.draws, ensemble.seed,
                            ensemble.method, setting.text(), threads);
}

/// A method with the setting for a level, to be measured with every number of threads.
struct Candidate {
  Ensemble ensemble;
  std::vector<std::unique_ptr<EnsembleWorker>> workers;
  std::vector<ThroughputRun*> rows;  ///< one per number of threads
};

/// All methods, levels and numbers of threads on a scene, in turn, so that a slow moment of the machine meets all alike.
std::vector<ThroughputRun> measure_scene(const ThroughputPlan& plan, const ThroughputPlan::Scene& scene,
                                         const std::vector<ThroughputCurve>& curves,
                                         const std::function<void(double)>& progress) {
  std::vector<ThroughputRun> rows;
  rows.reserve(curves.size() * plan.levels.size() * plan.threads.size());  // pointers to them are kept
  std::vector<std::unique_ptr<Candidate>> candidates;
  for (std::size_t m = 0; m < curves.size(); ++m) {
    for (const double level : plan.levels) {
      const ThroughputSetting* setting = setting_for(curves[m], level);
      std::unique_ptr<Candidate> candidate;
      if (setting) {
        candidate = std::make_unique<Candidate>();
        const double runs =
            std::clamp(1e6 * plan.seconds / setting->microseconds, kFewestRunsMeasured, kMostRunsMeasured);
        candidate->ensemble =
            ensemble_of(scene, plan.methods[m], setting->steps > 0 ? setting->steps : setting->tolerance,
                        static_cast<std::int64_t>(runs));
        candidate->workers = make_workers(candidate->ensemble, *std::ranges::max_element(plan.threads));
      }
      for (const int threads : plan.threads) {
        ThroughputRun& row = rows.emplace_back();
        row.scene = scene.name;
        row.method = curves[m].method;
        row.level = level;
        row.threads = threads;
        if (!setting) continue;
        row.is_reached = true;
        row.setting = *setting;
        row.runs = static_cast<double>(candidate->ensemble.n_runs());
        row.command = command_of(candidate->ensemble, *setting, threads);
        candidate->rows.push_back(&row);
      }
      if (candidate) candidates.push_back(std::move(candidate));
    }
  }
  std::map<ThroughputRun*, std::vector<Spent>> by_threads, by_processes;
  for (int k = 0; k < plan.repetitions; ++k) {
    progress(static_cast<double>(k) / plan.repetitions);
    for (const auto& candidate : candidates) {
      const std::int64_t runs = candidate->ensemble.n_runs();
      for (ThroughputRun* row : candidate->rows) {
        by_threads[row].push_back(spent_by_threads(candidate->workers, row->threads, runs));
        by_processes[row].push_back(spent_by_processes(*candidate->workers.front(), row->threads, runs));
      }
    }
  }
  const auto values_of = [](const std::vector<Spent>& list, double Spent::*part) {
    std::vector<double> values;
    for (const Spent& spent : list) values.push_back(spent.*part);
    return values;
  };
  for (auto& [row, list] : by_threads) {
    row->seconds = std::ranges::min(values_of(list, &Spent::wall));
    row->cpu_seconds = median(values_of(list, &Spent::cpu));
    row->process_seconds = std::ranges::min(values_of(by_processes[row], &Spent::wall));
    row->process_cpu_seconds = median(values_of(by_processes[row], &Spent::cpu));
  }
  return rows;
}

/// "levels": errors that nine of ten runs keep; "methods": [{"method", "steps" or "tolerances": {"from", "to",
/// "per_decade"}, from cheap to costly}]; "reference", "check": {"method", "tolerance"}, two methods of which the first
/// is what errors are measured against, and the second tells how well it is known; "scenes": [{"name", and "problem",
/// "parameters", "vary" of an ensemble}]; "seed"; "pilot_runs" that settings are chosen on; "seconds" of one thread
/// that a measurement takes, "repetitions" of it; "threads": 1, 2, 4, ... up to all by default.
void run_throughput(const json& experiment, ResultsFile& file) {
  const ThroughputPlan plan = read_throughput_plan(experiment);
  Progress progress(experiment.at("id").get<std::string>());
  const auto n_scenes = static_cast<double>(plan.scenes.size());
  for (std::size_t s = 0; s < plan.scenes.size(); ++s) {
    const ThroughputPlan::Scene& scene = plan.scenes[s];
    const auto update = [&](double share) { progress.update((static_cast<double>(s) + share) / n_scenes, scene.name); };
    const auto curves = file.rows<ThroughputCurve>(plan.methods.size(), [&] {
      const Pilot pilot = make_pilot(plan, scene);
      std::vector<ThroughputCurve> list;
      for (const auto& grid : plan.methods) {
        update(0.3 * static_cast<double>(list.size()) / static_cast<double>(plan.methods.size()));
        list.push_back(measure_curve(plan, scene, grid, pilot));
      }
      return list;
    });
    file.rows<ThroughputRun>(plan.methods.size() * plan.levels.size() * plan.threads.size(), [&] {
      return measure_scene(plan, scene, curves, [&](double share) { update(0.3 + 0.7 * share); });
    });
  }
}

void show_throughput(const Results& results, Section& section) {
  const auto curves = results.all<ThroughputCurve>();
  const auto runs = results.all<ThroughputRun>();
  for (const Chart& chart : throughput_charts(curves, runs, results.experiment())) section.chart(chart);
  if (runs.empty()) return;
  section.result("throughput", throughput_summary(runs));
  section.result("setup", throughput_setup_table(curves));
  section.details("threads", throughput_table(runs));
  section.details("settings", throughput_settings_table(curves));
  section.failures("unreached", throughput_failures(runs, curves));
}

constexpr const char* kThroughputFields = R"~({
  "required": ["levels", "methods", "reference", "check", "scenes", "pilot_runs", "repetitions", "seconds"],
  "properties": {
    "levels": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Errors that nine of ten runs keep.", "examples": [[1e-3, 1e-6]]},
    "methods": {"type": "array", "minItems": 1, "description": "With steps or tolerances, from cheap to costly.", "items": {"type": "object", "additionalProperties": false, "required": ["method"], "description": "A method with its settings.", "examples": [{"method": "moreau_jean"}], "properties": {
      "method": {"$ref": "#/$defs/method", "examples": ["moreau_jean"]},
      "steps": {"$ref": "#/$defs/range", "description": "Of a fixed-step method, from cheap to costly.", "examples": [{"from": 5, "to": 500, "per_decade": 4}]},
      "tolerances": {"$ref": "#/$defs/range", "description": "Of an error-controlled method, from cheap to costly.", "examples": [{"from": 0.01, "to": 1e-12, "per_decade": 1}]},
      "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "One of them.", "examples": [1e-13]}}}},
    "reference": {"type": "object", "additionalProperties": false, "required": ["method"], "description": "What errors are measured against.", "examples": [{"method": "event_driven", "tolerance": 1e-13}], "properties": {
      "method": {"$ref": "#/$defs/method", "examples": ["moreau_jean"]},
      "steps": {"$ref": "#/$defs/range", "description": "Of a fixed-step method, from cheap to costly.", "examples": [{"from": 5, "to": 500, "per_decade": 4}]},
      "tolerances": {"$ref": "#/$defs/range", "description": "Of an error-controlled method, from cheap to costly.", "examples": [{"from": 0.01, "to": 1e-12, "per_decade": 1}]},
      "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "One of them.", "examples": [1e-13]}}},
    "check": {"type": "object", "additionalProperties": false, "required": ["method"], "description": "Tells how well the reference is known.", "examples": [{"method": "cvode:adams", "tolerance": 1e-12}], "properties": {
      "method": {"$ref": "#/$defs/method", "examples": ["moreau_jean"]},
      "steps": {"$ref": "#/$defs/range", "description": "Of a fixed-step method, from cheap to costly.", "examples": [{"from": 5, "to": 500, "per_decade": 4}]},
      "tolerances": {"$ref": "#/$defs/range", "description": "Of an error-controlled method, from cheap to costly.", "examples": [{"from": 0.01, "to": 1e-12, "per_decade": 1}]},
      "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "One of them.", "examples": [1e-13]}}},
    "scenes": {"type": "array", "description": "Ensembles.", "items": {"type": "object", "additionalProperties": false, "required": ["problem", "vary"], "properties": {
      "name": {"type": "string", "description": "In tables; the problem without it.", "examples": ["ball"]},
      "problem": {"$ref": "#/$defs/problem", "examples": ["bouncing_ball"]},
      "parameters": {"$ref": "#/$defs/parameters", "examples": [{"e": 0.5}]},
      "vary": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "NAME=DISTRIBUTION, as in `ricochet ensemble`.", "examples": [["height=uniform(1,2)"]]}}}},
    "threads": {"type": "array", "minItems": 1, "items": {"type": "integer", "minimum": 1}, "description": "Numbers of threads; 1, 2, 4, ... up to all without it.", "examples": [[1, 2]]},
    "pilot_runs": {"type": "integer", "minimum": 10, "description": "Runs that settings are chosen on.", "examples": [100]},
    "repetitions": {"type": "integer", "minimum": 1, "description": "Of a measurement.", "examples": [5]},
    "seconds": {"type": "number", "exclusiveMinimum": 0, "description": "Of one thread that a measurement takes.", "examples": [1]},
    "seed": {"type": "integer", "minimum": 0, "description": "Of the ensembles.", "examples": [1]}
  }
})~";

// The study shows which errors a method does not reach, so that none of them is unexpected.
const bool throughput_is_registered =
    register_study({.kind = "throughput",
                    .summary = "runs per second and core of methods at the same error, for many initial values",
                    .fields = kThroughputFields,
                    .rows = {ThroughputCurve::kKind, ThroughputRun::kKind},
                    .run = run_throughput,
                    .show = show_throughput,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
