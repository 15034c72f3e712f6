#include "bench/run_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bench/environment.h"
#include "bench/progress.h"
#include "bench/results_file.h"
#include "bench/sensitivities.h"
#include "bench/timing.h"
#include "methods/registry.h"

namespace ricochet {
namespace {

constexpr int kAuditedSteps = 20000;  // the audit costs as much as a hundred steps
constexpr int kQuickSteps = 20000;

struct Job {
  std::string method;
  int steps = 0;
  double tolerance = 0;
  std::string on_failure;
  std::string not_built;
};

std::vector<Job> jobs_of(const Experiment& experiment, bool quick) {
  std::vector<Job> jobs;
  for (const auto& grid : experiment.methods) {
    for (const int steps : grid.steps) {
      if (!quick || steps <= kQuickSteps) jobs.push_back({grid.method, steps, 0, grid.on_failure, grid.not_built});
    }
    for (const double tolerance : grid.tolerances)
      jobs.push_back({grid.method, 0, tolerance, grid.on_failure, grid.not_built});
  }
  return jobs;
}

class ExperimentRun {
 public:
  ExperimentRun(const Experiment& experiment, const RunOptions& options)
      : experiment_(experiment), options_(options), problem_(experiment.make_problem()) {
    if (experiment.needs_reference) reference_ = experiment.make_reference(*problem_);
  }

  Record run(const Job& job, const std::string& instead_of) const;
  Record row_of(const Job& job, const std::string& instead_of) const;
  std::vector<TimedRun> timed_runs(const std::vector<Record>& records) const;
  Trajectory trajectory() const;

 private:
  Settings settings_of(int steps, double tolerance) const {
    Settings settings;
    settings.steps = steps;
    settings.tolerance = tolerance;
    settings.time_limit = options_.time_limit;
    settings.sensitivities = experiment_.sensitivities;
    return settings;
  }
  std::string problem_arguments() const;

  const Experiment& experiment_;
  const RunOptions& options_;
  std::unique_ptr<Problem> problem_;
  std::optional<reference::Reference> reference_;
};

std::string ExperimentRun::problem_arguments() const {
  const bool is_file = experiment_.problem.find(".json") != std::string::npos;
  std::string arguments = fmt::format("--{} {}", is_file ? "scene" : "problem", experiment_.problem);
  for (const auto& [name, value] : experiment_.parameters) arguments += fmt::format(" --set {}={}", name, value);
  return arguments;
}

/// What a row says before its run: of a method that is not built there is no more to say.
Record ExperimentRun::row_of(const Job& job, const std::string& instead_of) const {
  Record record;
  record.experiment = experiment_.id;
  record.problem = experiment_.problem;
  record.method = record.title = job.method;
  record.steps = job.steps;
  record.tolerance = job.tolerance;
  record.status = "not_built";
  record.message = job.not_built;
  record.error = std::numeric_limits<double>::quiet_NaN();
  record.sensitivities = experiment_.sensitivities;
  record.instead_of = instead_of;
  const std::string setting =
      job.steps > 0 ? fmt::format("--steps {}", job.steps) : fmt::format("--tolerance {:g}", job.tolerance);
  record.command = fmt::format("ricochet run {} --method {} {}", problem_arguments(), job.method, setting);
  for (const auto& name : experiment_.sensitivities) record.command += " --sensitivity " + name;
  return record;
}

Record ExperimentRun::run(const Job& job, const std::string& instead_of) const {
  Record record = row_of(job, instead_of);
  if (!job.not_built.empty()) return record;
  const auto method = make_method(job.method);
  Settings settings = settings_of(job.steps, job.tolerance);
  settings.audit = job.steps <= kAuditedSteps;
  const Solution solution = solve_with_sensitivities(*method, *problem_, settings);

  record.title = method->info().title;
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
  return record;
}

std::vector<TimedRun> ExperimentRun::timed_runs(const std::vector<Record>& records) const {
  std::vector<TimedRun> runs;
  for (const auto& record : records) {
    const std::shared_ptr<const Method> method = make_method(record.method);
    const Settings settings = settings_of(record.steps, record.tolerance);
    const auto begin = std::chrono::steady_clock::now();
    if (record.succeeded()) solve_with_sensitivities(*method, *problem_, settings);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    runs.push_back({record.method, seconds, [this, method, settings] {
                      const Solution solution = solve_with_sensitivities(*method, *problem_, settings);
                      if (solution.q.size() == 0) std::abort();  // keeps the call from being optimised away
                    }});
  }
  return runs;
}

Trajectory ExperimentRun::trajectory() const {
  Settings settings = settings_of(experiment_.trajectory_steps, 0);
  settings.recording = Recording::grid;
  settings.sensitivities.clear();
  const Solution solution = make_method(experiment_.trajectory_method)->solve(*problem_, settings);
  Trajectory trajectory{experiment_.problem, experiment_.trajectory_method, {}, {}, {}};
  const int n = problem_->info().n_mechanical();
  const auto add = [&](double t, const Vector& q, const Vector& v) {
    trajectory.t.push_back(t);
    trajectory.q.emplace_back(q.begin(), q.begin() + n);
    trajectory.v.emplace_back(v.begin(), v.begin() + n);
  };
  for (const auto& sample : solution.samples) {
    if (sample.v_minus != sample.v_plus) add(sample.t, sample.q, sample.v_minus);
    add(sample.t, sample.q, sample.v_plus);
  }
  add(solution.t, solution.q, solution.v);
  return trajectory;
}

}  // namespace

std::string run_experiment(const Experiment& experiment, const RunOptions& options) {
  nlohmann::json header = {{"kind", "header"},
                           {"schema", kResultsSchema},
                           {"experiment", experiment.id},
                           {"title", experiment.title},
                           {"description", experiment.description},
                           {"quick", options.quick},
                           {"command", options.command_line},
                           {"environment", environment()}};
  if (!experiment.overhead_of.empty()) header["overhead_of"] = experiment.overhead_of;
  header["key"] =
      hash_of(fmt::format("{} {} {} {}", experiment.text, program_hash(), options.quick, options.with_times));
  ResultsFile file(options.folder, experiment.id, header);
  if (file.is_complete()) return file.path();

  const ExperimentRun run(experiment, options);
  const auto jobs = jobs_of(experiment, options.quick);
  std::vector<Record> records = file.taken_over().records;
  const auto is_done = [&](const std::string& method, const Job& job, const std::string& instead_of) {
    return std::any_of(records.begin(), records.end(), [&](const Record& r) {
      return r.method == method && r.steps == job.steps && r.tolerance == job.tolerance && r.instead_of == instead_of;
    });
  };
  Progress progress(experiment.id + ": errors");
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    const Job& job = jobs[k];
    if (!is_done(job.method, job, "")) {
      records.push_back(run.run(job, ""));
      file.append(to_json(records.back()));
    }
    const auto own = std::find_if(records.begin(), records.end(), [&](const Record& r) {
      return r.method == job.method && r.steps == job.steps && r.tolerance == job.tolerance && r.instead_of.empty();
    });
    if (!own->succeeded() && !job.on_failure.empty() && !is_done(job.on_failure, job, job.method)) {
      records.push_back(run.run({job.on_failure, job.steps, job.tolerance, "", ""}, job.method));
      file.append(to_json(records.back()));
    }
    progress.update(static_cast<double>(k + 1) / static_cast<double>(jobs.size()),
                    fmt::format("{} {}", job.method, records.back().setting()));
  }
  progress.finish();

  if (options.with_times) {
    std::vector<Record> succeeded;
    std::vector<std::size_t> rows;
    for (std::size_t k = 0; k < records.size(); ++k) {
      if (!records[k].succeeded()) continue;
      succeeded.push_back(records[k]);
      rows.push_back(k);
    }
    Progress timing_progress(experiment.id + ": times");
    const auto timings = measure(run.timed_runs(succeeded), options.quick,
                                 [&](double share) { timing_progress.update(share, "random order"); });
    timing_progress.finish();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      file.append({{"kind", "timing"}, {"row", rows[k]}, {"timing", to_json(timings[k])}});
    }
  }
  if (!experiment.trajectory_method.empty()) file.append(to_json(run.trajectory()));
  file.finish();
  return file.path();
}

}  // namespace ricochet
