#include "reports/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

using nlohmann::json;

/// Every field of a row, by its name in the file.
template <class SomeRun, class Function>
void for_each_field(SomeRun& run, Function&& at) {
  at("experiment", run.experiment);
  at("problem", run.problem);
  at("parameters", run.parameters);
  at("scene", run.scene);
  at("group", run.group);
  at("labels", run.labels);
  at("conditions", run.conditions);
  at("method", run.method);
  at("steps", run.setting.steps);
  at("tolerance", run.setting.tolerance);
  at("sensitivities", run.sensitivities);
  at("options", run.options);
  at("instead_of", run.instead_of);
  at("expected", run.expected);
  at("title", run.title);
  at("nominal_order", run.nominal_order);
  at("status", run.status);
  at("message", run.message);
  at("reason", run.reason);
  at("h_bar", run.h_bar);
  at("error", run.error);
  at("reference_error", run.reference_error);
  at("solution_size", run.solution_size);
  at("max_residual", run.max_residual);
  at("detected_events", run.detected_events);
  at("counters", run.counters);
  at("metrics", run.metrics);
  at("values", run.values);
  at("timing", run.timing);
  at("peak_bytes", run.peak_bytes);
}

}  // namespace

std::string problem_options(const std::string& problem, const std::map<std::string, double>& parameters) {
  const bool is_file = problem.find(".json") != std::string::npos;
  std::string text = fmt::format("--{} {}", is_file ? "scene" : "problem", problem);
  for (const auto& [name, value] : parameters) text += fmt::format(" --set {}={}", name, value);
  return text;
}

bool Run::failed() const {
  return !succeeded() && status != "not_built" && status != "declined" && status != "not_run";
}

bool Run::has_error() const {
  return succeeded() && std::isfinite(error);
}

double Run::value(const std::string& name) const {
  const auto there = values.find(name);
  return there == values.end() ? std::numeric_limits<double>::quiet_NaN() : there->second;
}

std::string Run::command() const {
  if (problem.empty()) return "";
  std::string text =
      fmt::format("ricochet run {} --method {} {}", problem_options(problem, parameters), method, setting.option());
  for (const auto& variable : sensitivities) text += " --sensitivity " + variable;
  return options.empty() ? text : text + " " + options;
}

void to_json(json& j, const Run& run) {
  j = json::object();
  for_each_field(run, [&](const char* name, const auto& value) { j[name] = value; });
  j["command"] = run.command();  // for readers of the file; it is derived again
}

void from_json(const json& j, Run& run) {
  for_each_field(run, [&](const char* name, auto& value) {
    if (const auto found = j.find(name); found != j.end()) found->get_to(value);
  });
}

std::vector<const Run*> runs_of(const std::vector<Run>& runs, const std::string& method) {
  std::vector<const Run*> list;
  for (const auto& run : runs) {
    if (run.method == method && run.instead_of.empty()) list.push_back(&run);
  }
  std::ranges::stable_sort(list, [](const Run* a, const Run* b) { return a->setting < b->setting; });
  return list;
}

}  // namespace ricochet
