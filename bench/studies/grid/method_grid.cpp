#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/measure/allocations.h"
#include "bench/measure/metrics/metric_tables.h"
#include "bench/measure/metrics/metrics.h"
#include "bench/measure/sensitivities.h"
#include "bench/measure/timing.h"
#include "bench/measure/trajectory_of.h"
#include "bench/rows/progress.h"
#include "bench/studies/grid/grid_experiment.h"
#include "bench/studies/grid/grid_tables.h"
#include "bench/studies/grid/work_precision.h"
#include "bench/studies/study.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr int kAuditedSteps = 20000;  // the audit costs as much as a hundred steps
constexpr int kQuickSteps = 20000;    // more are left out of a quick run, unless a method had none then

struct Job {
  std::string method;
  int steps = 0;
  double tolerance = 0;
  const GridExperiment::MethodGrid* grid;  ///< that it is of
};

std::vector<Job> jobs_of(const GridExperiment& experiment) {
  std::vector<Job> jobs;
  for (const auto& grid : experiment.methods) {
    for (const int steps : grid.steps) {
      if (!experiment.quick || steps <= kQuickSteps || steps == grid.steps.front())
        jobs.push_back({grid.method, steps, 0, &grid});
    }
    for (const double tolerance : grid.tolerances) jobs.push_back({grid.method, 0, tolerance, &grid});
  }
  return jobs;
}

class GridRun {
 public:
  explicit GridRun(const GridExperiment& experiment)
      : experiment_(experiment), problem_(experiment.problem.make_problem()) {
    if (experiment.needs_reference) reference_ = experiment.problem.make_reference(*problem_, experiment.sensitivities);
    if (experiment.with_metrics && reference_) reference_motion_ = reference_motion(*problem_, *reference_);
  }

  Record run(const Job& job, const std::string& instead_of) const;
  Record row_of(const Job& job, const std::string& instead_of) const;
  std::vector<TimedRun> timed_runs(const std::vector<const Record*>& records) const;
  Trajectory trajectory() const;

 private:
  Settings settings_of(int steps, double tolerance) const {
    Settings settings;
    settings.steps = steps;
    settings.tolerance = tolerance;
    settings.time_limit = experiment_.time_limit;
    settings.sensitivities = experiment_.sensitivities;
    return settings;
  }

  const GridExperiment& experiment_;
  std::unique_ptr<Problem> problem_;
  std::optional<reference::Reference> reference_;
  ReferenceMotion reference_motion_;
};

/// What a row says before its run: of a method that is not built there is no more to say.
Record GridRun::row_of(const Job& job, const std::string& instead_of) const {
  Record record;
  record.experiment = experiment_.id;
  record.problem = experiment_.problem.problem;
  record.method = record.title = job.method;
  record.steps = job.steps;
  record.tolerance = job.tolerance;
  record.status = "not_built";
  record.message = job.grid->not_built;
  record.error = std::numeric_limits<double>::quiet_NaN();
  record.sensitivities = experiment_.sensitivities;
  record.instead_of = instead_of;
  record.expected = job.grid->may_fail;
  record.command = run_command(experiment_.problem.arguments(), job.method, job.steps, job.tolerance);
  for (const auto& name : experiment_.sensitivities) record.command += " --sensitivity " + name;
  return record;
}

Record GridRun::run(const Job& job, const std::string& instead_of) const {
  Record record = row_of(job, instead_of);
  if (instead_of.empty() && !job.grid->not_built.empty()) return record;
  const auto method = make_method(job.method);
  record.title = method->info().title;
  if (const Support support = method->can_run(problem_->info()); !support.ok) {
    record.status = "declined";
    record.message = support.reason;
    return record;
  }
  Settings settings = settings_of(job.steps, job.tolerance);
  settings.audit = job.steps <= kAuditedSteps;
  Solution solution;
  try {
    solution = solve_with_sensitivities(*method, *problem_, settings);
  } catch (const InputError& error) {  // a method that cannot tell before it runs
    record.status = "declined";
    record.message = error.what();
    return record;
  }

  record.nominal_order = method->info().order_impacts;
  record.status = to_string(solution.status);
  record.message = solution.message;
  record.counters = solution.counters;
  record.detected_events = static_cast<int>(solution.events.size());
  record.max_residual = solution.max_residual();
  record.h_bar = solution.t / std::max<double>(1, static_cast<double>(solution.counters.elements));
  // A step with an impact may hold more elements; the nominal length T / (N_sim N_FE) is what the orders are drawn
  // against.
  if (job.steps > 0 && solution.succeeded()) {
    const double per_step = std::round(static_cast<double>(solution.counters.elements) / job.steps);
    record.h_bar = problem_->info().end_time / (job.steps * std::max(1.0, per_step));
  }
  if (reference_) {
    record.reference_error = reference_->uncertainty;
    record.solution_size = reference_->size();
    if (solution.succeeded()) record.error = reference_->error_of(solution);
  }
  if (experiment_.with_metrics && solution.succeeded()) {
    settings.audit = false;
    record.metrics = metrics_of_run(*method, *problem_, settings, solution.counters.steps, reference_motion_);
  }
  return record;
}

std::vector<TimedRun> GridRun::timed_runs(const std::vector<const Record*>& records) const {
  std::vector<TimedRun> runs;
  for (const Record* record : records) {
    const std::shared_ptr<const Method> method = make_method(record->method);
    const Settings settings = settings_of(record->steps, record->tolerance);
    const auto run = [this, method, settings] { return solve_with_sensitivities(*method, *problem_, settings); };
    Solution solution;
    const double seconds = seconds_of(run, solution);  // without the audit of its first run
    runs.push_back({record->method, seconds, [run] { return run().own_seconds; }});
  }
  return runs;
}

Trajectory GridRun::trajectory() const {
  Settings settings = settings_of(experiment_.trajectory_steps, 0);
  settings.recording = Recording::motion;
  settings.sensitivities.clear();
  const Solution solution = make_method(experiment_.trajectory_method)->solve(*problem_, settings);
  return trajectory_of(*problem_, experiment_.trajectory_method, setting_text(settings.steps, 0), solution);
}

/// First every run once, audited, with its error; behind a run that failed the one that answers it.
std::vector<Record> run_jobs(const GridExperiment& experiment, const GridRun& grid, ResultsFile& file) {
  const auto jobs = jobs_of(experiment);
  Progress progress(experiment.id + ": errors");
  const auto run = [&](std::size_t k, const ResultsFile::NextRow<Record>& next) {
    const Job& job = jobs[k];
    const Record record = next([&] { return grid.run(job, ""); });
    if (record.succeeded() || job.grid->on_failure.empty()) return;
    const Job answer{job.grid->on_failure, job.steps, job.tolerance, job.grid};
    next([&] { return grid.run(answer, job.method); });
  };
  return file.pieces<Record>(jobs.size(), run, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(jobs.size()),
                    fmt::format("{} {}", jobs[k].method, setting_text(jobs[k].steps, jobs[k].tolerance)));
  });
}

/// Then, in one session, the times of all that succeeded.
std::vector<TimingRow> measure_times(const GridExperiment& experiment, const GridRun& grid,
                                     const std::vector<Record>& records) {
  std::vector<const Record*> succeeded;
  std::vector<TimingRow> rows;
  for (std::size_t k = 0; k < records.size(); ++k) {
    if (!records[k].succeeded()) continue;
    succeeded.push_back(&records[k]);
    rows.push_back({k, {}, Metrics::kNone});
  }
  Progress progress(experiment.id + ": times");
  const auto runs = grid.timed_runs(succeeded);
  const auto timings = measure(runs, experiment.quick, [&](double share) { progress.update(share, "random order"); });
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].timing = timings[k];
    rows[k].peak_bytes = peak_bytes_of(runs[k].run);
  }
  return rows;
}

void run_method_grid(const nlohmann::json& document, ResultsFile& file) {
  const GridExperiment experiment = read_grid_experiment(document);
  const GridRun grid(experiment);
  if (!experiment.overhead_of.empty()) file.header()["overhead_of"] = experiment.overhead_of;
  const std::vector<Record> records = run_jobs(experiment, grid, file);
  if (experiment.with_times) {
    const auto n = static_cast<std::size_t>(std::ranges::count_if(records, &Record::succeeded));
    file.rows<TimingRow>(n, [&] { return measure_times(experiment, grid, records); });
  }
  if (!experiment.trajectory_method.empty()) file.row<Trajectory>([&] { return grid.trajectory(); });
}

void show_method_grid(const Results& file, Section& section) {
  const GridResults results(file);
  for (const auto& trajectory : results.trajectories) {
    if (!trajectory.picture.empty()) {
      section.svg_figures([=, id = results.id](const FigureFolder& folder) {
        const Figure figure{id + "_scene.svg", trajectory.problem, "The scene in motion, " + trajectory.method + ".",
                            trajectory};
        folder.write(figure.file, trajectory.picture);
        return std::vector{figure};
      });
    }
    section.figures([=, id = results.id](const FigureFolder& folder) {
      return std::vector{draw_trajectory(folder, trajectory, id + "_trajectory")};
    });
  }
  if (results.has_errors()) {
    section.chart(order_chart(results));
    section.result("orders", order_summary(results));
  }
  if (results.has_errors() && !results.timings.empty()) {
    section.chart(work_precision_chart(results));
    section.result("time_to_reach", time_to_reach(results));
  }
  if (!results.overhead_of.empty()) section.result("overhead", overhead(results));
  section.failures("failures", failures(results));
  section.details("runs", order_details(results));
  show_metrics(measured_runs(results), section);
  if (!results.timings.empty()) section.details("times", precision_details(results));
}

bool is_surprise(const Record& record) {
  return !record.succeeded() && record.status != "not_built" && record.status != "declined" &&
         record.expected.empty() && record.instead_of.empty();
}

std::string method_grid_failure(const nlohmann::json& line) {
  if (line.at("kind") != Record::kKind) return "";
  const auto record = parse_line(line.dump()).get<Record>();
  if (!is_surprise(record)) return "";
  return fmt::format("{} {}: {}: {}", record.method, setting_text(record.steps, record.tolerance), record.status,
                     record.message);
}

/// A run that failed although the experiment says nothing of that, and no other method answered it.
int method_grid_surprises(const Results& file) {
  const auto records = file.all<Record>();
  const auto is_answered = [&](const Record& record) {
    return std::ranges::any_of(records, [&](const Record& other) {
      return other.instead_of == record.method && other.setting() == record.setting() && other.succeeded();
    });
  };
  return static_cast<int>(std::ranges::count_if(
      records, [&](const Record& record) { return is_surprise(record) && !is_answered(record); }));
}

constexpr const char* kMethodGridFields = R"~({
  "required": ["problem", "methods"],
  "properties": {
    "problem": {"$ref": "#/$defs/problem", "examples": ["two_balls_spring"]},
    "parameters": {"$ref": "#/$defs/parameters", "examples": [{"height": 2}]},
    "reference": {"type": "null", "description": "null: no reference is computed, so rows have no errors. Without this field the reference is the solution known to many digits, or one by SUNDIALS with located events.", "examples": [null]},
    "sensitivities": {"type": "array", "items": {"type": "string"}, "description": "q0:0, v0:0 or param:NAME: whose error is measured instead of the state's, against a ground truth.", "examples": [["param:e"]]},
    "grids": {"type": "object", "additionalProperties": {"$ref": "#/$defs/steps"}, "description": "Grids of steps by name.", "examples": [{"short": [10, 20, 40]}]},
    "methods": {"type": "array", "minItems": 1, "description": "Methods, each with steps or with tolerances.", "items": {
      "type": "object", "additionalProperties": false, "required": ["method"], "properties": {
        "method": {"$ref": "#/$defs/method", "examples": ["fesd:gauss:3"]},
        "steps": {"$ref": "#/$defs/steps", "description": "Of a fixed-step method: numbers, a range, the name of a grid, or a list of those.", "examples": [[10, 20]]},
        "tolerances": {"$ref": "#/$defs/tolerances", "description": "Of an error-controlled method.", "examples": [[1e-6]]},
        "on_failure": {"$ref": "#/$defs/method", "description": "A method that is run where this one fails.", "examples": ["fesd:gauss:3,n_fe=3"]},
        "may_fail": {"type": "string", "description": "Why a failure is no surprise.", "examples": ["too few elements"]}}}},
    "trajectory": {"type": "object", "additionalProperties": false, "required": ["method", "steps"], "description": "A run with all grid points, for a figure.", "properties": {
      "method": {"$ref": "#/$defs/method", "examples": ["fesd:gauss:3"]},
      "steps": {"type": "integer", "minimum": 1, "description": "Number of steps.", "examples": [200]}}},
    "metrics": {"type": "boolean", "description": "false: errors at the end alone, not those of the whole motion and by law.", "examples": [false]},
    "overhead_of": {"type": "object", "additionalProperties": {"type": "string"}, "description": "By method the one its cost is compared with.", "examples": [{"fesd:gauss:2,n_fe=1": "irk:gauss:2,contacts=ignored"}]}
  }
})~";

const bool method_grid_is_registered = register_study(
    {.kind = kDefaultStudy,
     .summary = "methods on a grid of step lengths or tolerances: orders, speed against error, cost beside another",
     .fields = kMethodGridFields,
     .rows = {Record::kKind, TimingRow::kKind, Trajectory::kKind},
     .reads_quick = true,
     .times = Times::behind,
     .run = run_method_grid,
     .show = show_method_grid,
     .failure = method_grid_failure,
     .surprises = method_grid_surprises});

}  // namespace
}  // namespace ricochet
