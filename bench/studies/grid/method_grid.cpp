#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bench/experiment/study.h"
#include "bench/measure/allocations.h"
#include "bench/measure/measure_run.h"
#include "bench/measure/metrics/metric_tables.h"
#include "bench/measure/trajectory_of.h"
#include "bench/rows/progress.h"
#include "bench/studies/grid/grid_experiment.h"
#include "bench/studies/grid/grid_tables.h"
#include "bench/studies/grid/work_precision.h"
#include "methods/registry.h"

namespace ricochet {
namespace {

constexpr int kAuditedSteps = 20000;  // the audit costs as much as a hundred steps
constexpr int kQuickSteps = 20000;    // more are left out of a quick run, unless a method had none then

/// A run of the plan, and the method that answers its failure; empty for none.
struct Job {
  Run run;
  std::string on_failure;
};

std::vector<Job> jobs_of(const GridExperiment& experiment) {
  std::vector<Job> jobs;
  for (const auto& grid : experiment.methods) {
    const auto plan = [&](const Setting& setting) {
      Run run = planned_run(experiment.problem, grid.method, setting);
      run.experiment = experiment.id;
      run.sensitivities = experiment.sensitivities;
      run.expected = grid.may_fail;
      jobs.push_back({std::move(run), grid.on_failure});
    };
    for (const int steps : grid.steps) {
      if (!experiment.quick || steps <= kQuickSteps || steps == grid.steps.front()) plan({.steps = steps});
    }
    for (const double tolerance : grid.tolerances) plan({.tolerance = tolerance});
  }
  return jobs;
}

/// The problem of the experiment with its reference.
struct GridProblem {
  explicit GridProblem(const GridExperiment& experiment) : problem(experiment.problem.make_problem()) {
    if (experiment.needs_reference) reference = experiment.problem.make_reference(*problem, experiment.sensitivities);
    if (experiment.with_metrics && reference) motion = reference_motion(*problem, *reference);
    measurement.time_limit = experiment.time_limit;
    measurement.reference = reference ? &*reference : nullptr;
    measurement.motion = experiment.with_metrics ? &motion : nullptr;
  }

  std::unique_ptr<Problem> problem;
  std::optional<reference::Reference> reference;
  ReferenceMotion motion;
  Measurement measurement{.problem = *problem, .most_audited_steps = kAuditedSteps};
};

Trajectory trajectory(const GridExperiment& experiment, const GridProblem& grid) {
  Settings settings;
  settings.steps = experiment.trajectory_steps;
  settings.time_limit = experiment.time_limit;
  settings.recording = Recording::motion;
  const Solution solution = make_method(experiment.trajectory_method)->solve(*grid.problem, settings);
  return trajectory_of(*grid.problem, experiment.trajectory_method, Setting{.steps = settings.steps}.text(), solution);
}

/// First every run once, audited, with its error; after a run that failed the one that answers it.
std::vector<Run> run_jobs(const GridExperiment& experiment, const GridProblem& grid, ResultsFile& file) {
  const auto jobs = jobs_of(experiment);
  Progress progress(experiment.id + ": errors");
  const auto measured = [&](Run run) {
    measure_run(grid.measurement, run);
    return run;
  };
  const auto run = [&](std::size_t k, const ResultsFile::NextRow<Run>& next) {
    const Run made = next([&] { return measured(jobs[k].run); });
    if (made.succeeded() || jobs[k].on_failure.empty()) return;
    Run answer = jobs[k].run;
    answer.instead_of = std::exchange(answer.method, jobs[k].on_failure);
    next([&] { return measured(answer); });
  };
  return file.pieces<Run>(jobs.size(), run, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(jobs.size()),
                    fmt::format("{} {}", jobs[k].run.method, jobs[k].run.setting.text()));
  });
}

/// Then, in one session, the times of all that succeeded.
std::vector<TimingRow> measure_times(const GridExperiment& experiment, const GridProblem& grid,
                                     const std::vector<Run>& runs) {
  std::vector<TimedRun> timed;
  std::vector<TimingRow> rows;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (!runs[k].succeeded()) continue;
    timed.push_back(timed_run(grid.measurement, runs[k]));
    rows.push_back({k, {}, Metrics::kNone});
  }
  Progress progress(experiment.id + ": times");
  const auto timings =
      time_runs(timed, experiment.quick, [&](double share) { progress.update(share, "random order"); });
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].timing = timings[k];
    rows[k].peak_bytes = peak_bytes_of(timed[k].run);
  }
  return rows;
}

void run_method_grid(const nlohmann::json& document, ResultsFile& file) {
  const GridExperiment experiment = read_grid_experiment(document);
  const GridProblem grid(experiment);
  if (!experiment.overhead_of.empty()) file.header()["overhead_of"] = experiment.overhead_of;
  const std::vector<Run> runs = run_jobs(experiment, grid, file);
  if (experiment.with_times) {
    const auto n = static_cast<std::size_t>(std::ranges::count_if(runs, &Run::succeeded));
    file.rows<TimingRow>(n, [&] { return measure_times(experiment, grid, runs); });
  }
  if (!experiment.trajectory_method.empty()) file.row<Trajectory>([&] { return trajectory(experiment, grid); });
}

void show_method_grid(const Results& file, Section& section) {
  const GridResults results(file);
  for (const auto& trajectory : results.trajectories) {
    if (!trajectory.picture.empty()) {
      section.drawings([=, id = results.id](const FigureFolder& folder) {
        const Figure figure{id + "_scene.svg", trajectory.problem, "The scene in motion, " + trajectory.method + ".",
                            trajectory};
        folder.write(figure.file, trajectory.picture);
        return std::vector{figure};
      });
    }
    section.chart(trajectory_chart(trajectory, results.id + "_trajectory"));
  }
  if (results.has_errors()) {
    section.chart(order_chart(results));
    section.result("orders", order_summary(results));
  }
  if (results.has_errors() && !results.timings.empty()) {
    section.chart(work_precision_chart(results), "work_precision", work_precision_data(results));
    section.result("time_to_reach", time_to_reach(results));
  }
  if (!results.overhead_of.empty()) section.result("overhead", overhead(results));
  section.failures("failures", failures(results));
  section.details("runs", order_details(results));
  show_metrics(measured_runs(results), section);
  if (!results.timings.empty()) section.details("times", precision_details(results));
}

/// A failure that the experiment does not expect; a run in place of another one may fail.
bool is_unexpected(const Run& run) {
  return run.failed() && run.expected.empty() && run.instead_of.empty();
}

std::string method_grid_failure(const nlohmann::json& line) {
  if (line.at("kind") != Run::kKind) return "";
  const auto run = parse_line(line.dump()).get<Run>();
  if (!is_unexpected(run)) return "";
  return fmt::format("{} {}: {}: {}", run.method, run.setting.option(), run.status, run.message);
}

/// Unexpected failures that no other method answered.
int method_grid_unexpected_failures(const Results& file) {
  const auto runs = file.all<Run>();
  const auto is_answered = [&](const Run& run) {
    return std::ranges::any_of(runs, [&](const Run& other) {
      return other.instead_of == run.method && other.setting == run.setting && other.succeeded();
    });
  };
  return static_cast<int>(
      std::ranges::count_if(runs, [&](const Run& run) { return is_unexpected(run) && !is_answered(run); }));
}

constexpr const char* kMethodGridFields = R"~({
  "required": ["problem", "methods"],
  "properties": {
    "problem": {"$ref": "#/$defs/problem", "examples": ["two_balls_spring"]},
    "parameters": {"$ref": "#/$defs/parameters", "examples": [{"height": 2}]},
    "reference": {"type": "null", "description": "null: no reference is computed, and rows have no errors. Default: the certified solution if one is known, else a solution by SUNDIALS with located events.", "examples": [null]},
    "sensitivities": {"type": "array", "items": {"type": "string"}, "description": "Variables q0:K, v0:K or param:NAME; the error is that of derivatives with respect to them, against a certified solution.", "examples": [["param:e"]]},
    "grids": {"type": "object", "additionalProperties": {"$ref": "#/$defs/steps"}, "description": "Grids of steps by name.", "examples": [{"short": [10, 20, 40]}]},
    "methods": {"type": "array", "minItems": 1, "description": "Methods, each with steps or with tolerances.", "items": {
      "type": "object", "additionalProperties": false, "required": ["method"], "properties": {
        "method": {"$ref": "#/$defs/method", "examples": ["fesd:gauss:3"]},
        "steps": {"$ref": "#/$defs/steps", "description": "Of a fixed-step method: numbers, a range, the name of a grid, or a list of those.", "examples": [[10, 20]]},
        "tolerances": {"$ref": "#/$defs/tolerances", "description": "Of an error-controlled method.", "examples": [[1e-6]]},
        "on_failure": {"$ref": "#/$defs/method", "description": "A method that is run where this one fails.", "examples": ["fesd:gauss:3,n_fe=3"]},
        "may_fail": {"type": "string", "description": "Reason for an expected failure.", "examples": ["too few elements"]}}}},
    "trajectory": {"type": "object", "additionalProperties": false, "required": ["method", "steps"], "description": "A run with all grid points, for a figure.", "properties": {
      "method": {"$ref": "#/$defs/method", "examples": ["fesd:gauss:3"]},
      "steps": {"type": "integer", "minimum": 1, "description": "Number of steps.", "examples": [200]}}},
    "metrics": {"type": "boolean", "description": "false: only errors at the end time, not those of the whole motion and of each law.", "examples": [false]},
    "overhead_of": {"type": "object", "additionalProperties": {"type": "string"}, "description": "By method the one its cost is compared with.", "examples": [{"fesd:gauss:2,n_fe=1": "irk:gauss:2,contacts=ignored"}]}
  }
})~";

const bool method_grid_is_registered = register_study(
    {.kind = kDefaultStudy,
     .summary = "methods on a grid of step lengths or tolerances: orders, speed against error, cost beside another",
     .fields = kMethodGridFields,
     .rows = {Run::kKind, TimingRow::kKind, Trajectory::kKind},
     .reads_quick = true,
     .times = Times::after,
     .run = run_method_grid,
     .show = show_method_grid,
     .failure = method_grid_failure,
     .unexpected_failures = method_grid_unexpected_failures});

}  // namespace
}  // namespace ricochet
