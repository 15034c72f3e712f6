#include "bench/measure/measure_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/measure/sensitivities.h"
#include "methods/isolated.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/results.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr int kFirstImpressions = 2;
constexpr double kShort = 0.05;  // [s]

Solution without_run(Run& run, const char* status, const std::string& reason) {
  run.status = status;
  run.message = reason;
  Solution solution;
  solution.status = Status::infeasible;
  solution.message = reason;
  return solution;
}

/// Mean length of a Runge-Kutta step. A fixed-step run has its nominal length T / (N_sim N_FE), against which orders are
/// drawn, although a step with an impact may hold more elements. Where formulas bend or jump, counters include the runs
/// that locate borders.
double mean_length(const Solution& solution, const Setting& setting, const ProblemInfo& info) {
  const auto elements = static_cast<double>(solution.counters.elements);
  if (setting.is_tolerance() || !solution.succeeded()) return solution.t / std::max(1.0, elements);
  const auto steps = static_cast<double>(info.switches.empty() ? setting.steps : solution.counters.steps);
  return info.end_time / (setting.steps * std::max(1.0, std::round(elements / std::max(1.0, steps))));
}

}  // namespace

std::string reason_not_built(const std::string& spec) {
  for (const MethodEntry& entry : methods()) {
    if (entry.name == MethodSpec(spec).name() && !entry.make) return entry.not_built;
  }
  return "";
}

Setting setting_of(const Method& method, int steps, double tolerance) {
  return method.info().is_adaptive ? Setting{0, tolerance} : Setting{steps, 0};
}

void require_kind_of_setting(const Method& method, const std::string& steps, const std::string& tolerance) {
  const MethodInfo info = method.info();
  if (info.is_adaptive && !steps.empty())
    throw InputError(fmt::format("{}: {} controls its error, it takes a tolerance and no steps", steps, info.id));
  if (!info.is_adaptive && !tolerance.empty())
    throw InputError(fmt::format("{}: {} takes fixed steps and no tolerance", tolerance, info.id));
}

Run planned_run(const ProblemChoice& choice, const std::string& method, const Setting& setting) {
  Run run;
  run.problem = choice.problem;
  run.parameters = choice.parameters;
  run.method = run.title = method;
  run.setting = setting;
  run.message = reason_not_built(method);
  if (!run.message.empty()) run.status = "not_built";
  return run;
}

Settings Measurement::settings(const Run& run) const {
  Settings settings;
  settings.steps = run.setting.steps;
  settings.tolerance = run.setting.tolerance;
  settings.time_limit = time_limit;
  settings.recording = recording;
  settings.sensitivities = run.sensitivities;
  return settings;
}

Solution measure_run(const Measurement& what, Run& run) {
  if (const std::string reason = reason_not_built(run.method); !reason.empty())
    return without_run(run, "not_built", reason);
  return measure_run(what, *make_method(run.method), run);
}

Solution measure_run(const Measurement& what, const Method& method, Run& run, Solver* kept) {
  const MethodInfo info = method.info();
  run.title = info.title;
  if (const Support support = method.can_run(what.problem.info()); !support.ok)
    return without_run(run, "declined", support.reason);
  Settings settings = what.settings(run);
  settings.audit = run.setting.steps <= what.most_audited_steps;
  Solution solution;
  try {
    solution = kept              ? kept->solve(settings)
               : what.change > 0 ? solve_with_differences(method, what.problem, settings, what.change)
                                 : solve_with_sensitivities(method, what.problem, settings);
  } catch (const InputError& error) {  // a method that cannot tell before it runs
    return without_run(run, "declined", error.what());
  }
  run.nominal_order = info.order_impacts;
  run.status = to_string(solution.status);
  run.message = solution.message;
  run.reason = solution.reason;
  run.counters = solution.counters;
  run.detected_events = static_cast<int>(solution.events.size());
  run.max_residual = solution.max_residual();
  run.h_bar = mean_length(solution, run.setting, what.problem.info());
  if (what.reference) {
    run.reference_error = what.reference->uncertainty;
    run.solution_size = what.reference->size();
    if (solution.succeeded()) run.error = what.reference->error_of(solution);
  }
  if (what.motion && solution.succeeded()) {
    settings.audit = false;
    run.metrics = metrics_of_run(method, what.problem, settings, solution.counters.steps, *what.motion);
  }
  return solution;
}

Run measured_in_child(const Run& planned, double seconds, const std::function<Run(const Run&)>& measure) {
  const IsolatedResult result = run_isolated([&] { return json(measure(planned)).dump(); }, seconds);
  if (result.ending == IsolatedResult::Ending::returned) return parse_line(result.text).get<Run>();
  Run run = planned;
  const bool is_killed = result.ending == IsolatedResult::Ending::killed;
  run.status = is_killed ? "killed" : "crashed";
  run.message = is_killed ? fmt::format("no result within {} s", seconds) : result.text;
  if (is_killed) run.timing = {seconds, seconds, seconds, seconds, 1};
  return run;
}

TimedRun timed_run(const Measurement& what, const Run& run, std::shared_ptr<Solver> kept, double seconds) {
  const std::shared_ptr<const Method> method = make_method(run.method);
  const auto again = [method, kept, &problem = what.problem, settings = what.settings(run)] {
    return kept ? kept->solve(settings) : solve_with_sensitivities(*method, problem, settings);
  };
  Solution solution;
  for (int k = 0; k < kFirstImpressions && seconds < kShort; ++k) {
    const double impression = seconds_of(again, solution);
    seconds = seconds > 0 ? std::min(seconds, impression) : impression;
  }
  return {run.method, seconds, [again] { return again().own_seconds; }};
}

}  // namespace ricochet
