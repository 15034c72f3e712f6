#include "bench/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "problems/scene_file/scene_file.h"
#include "reference/ground_truth.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const char* const kFolder = "bench/experiments";

/// A grid: numbers of steps, or {"from", "to", "per_decade"} for a logarithmic one, or the name of a grid, or a list of
/// those.
std::vector<int> read_steps(const json& value, const json& grids, const std::string& field) {
  std::vector<int> steps;
  if (value.is_string()) {
    const std::string name = value;
    if (!grids.contains(name))
      throw_unknown_name("grid in " + field, name, keys_of(grids.get<std::map<std::string, json>>()));
    steps = read_steps(grids[name], grids, field);
  } else if (value.is_array()) {
    for (const auto& entry : value) {
      const auto part = entry.is_number() ? std::vector<int>{entry.get<int>()} : read_steps(entry, grids, field);
      steps.insert(steps.end(), part.begin(), part.end());
    }
  } else {
    const double from = value.at("from"), to = value.at("to"), per_decade = value.at("per_decade");
    const int count = static_cast<int>(std::lround(std::log10(to / from) * per_decade));
    for (int k = 0; k <= count; ++k)
      steps.push_back(static_cast<int>(std::lround(from * std::pow(10, k / per_decade))));
  }
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  if (steps.empty() || steps.front() < 1) throw InputError(field, value.dump(), "numbers of steps >= 1 are required");
  return steps;
}

/// Of a method that is registered without its library; empty for every other one.
std::string why_not_built(const std::string& spec) {
  for (const auto& entry : methods()) {
    if (entry.name == MethodSpec(spec).name() && !entry.make) return entry.not_built;
  }
  return {};
}

}  // namespace

std::string find_project_file(const std::string& path) {
  if (fs::exists(path)) return path;
  const fs::path in_source = fs::path(RICOCHET_SOURCE_DIR) / path;
  return fs::exists(in_source) ? in_source.string() : path;
}

std::vector<std::string> experiment_names() {
  std::vector<std::string> names;
  const fs::path folder = find_project_file(kFolder);
  if (fs::exists(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::pair<std::string, std::string> read_experiment_text(const std::string& name) {
  std::string path = name;
  if (!fs::exists(path)) path = find_project_file(fmt::format("{}/{}.json", kFolder, name));
  std::ifstream file(path);
  if (!file || fs::is_directory(path)) throw_unknown_name("experiment", name, experiment_names());
  std::ostringstream content;
  content << file.rdbuf();
  return {path, content.str()};
}

ExperimentOutline outline_of(const std::string& name) {
  const auto [path, text] = read_experiment_text(name);
  try {
    const json document = json::parse(text);
    return {document.value("title", name), document.value("parts", std::vector<std::string>{name})};
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not an experiment: {}", path, error.what()));
  }
}

Experiment read_experiment(const std::string& name) {
  const auto [path_of_file, text] = read_experiment_text(name);
  const std::string& path = path_of_file;
  Experiment experiment;
  experiment.text = text;
  const auto place = [&](const std::string& field) { return path + ": " + field; };
  try {
    const json document = json::parse(experiment.text);
    if (document.contains("kind"))
      throw InputError(place("kind"), document["kind"].dump(),
                       "this experiment is run by `ricochet compare`, or `ricochet report hard-cases`");
    static const std::set<std::string> known = {"id",         "title",         "description", "problem",
                                                "parameters", "sensitivities", "grids",       "reference",
                                                "methods",    "trajectory",    "overhead_of"};
    for (const auto& [key, value] : document.items()) {
      if (!known.contains(key)) throw_unknown_name("field of " + path, key, {known.begin(), known.end()});
    }
    experiment.id = document.at("id");
    experiment.title = document.value("title", experiment.id);
    experiment.description = document.value("description", "");
    experiment.problem = document.at("problem");
    experiment.parameters = document.value("parameters", ParameterChanges{});
    if (document.contains("reference")) {
      const json& reference = document["reference"];
      if (reference.is_null()) {
        experiment.needs_reference = false;
      } else {
        experiment.ground_truth_file = reference.at("ground_truth");
        experiment.ground_truth_case = reference.at("case");
      }
    }
    experiment.sensitivities = document.value("sensitivities", experiment.sensitivities);
    if (!experiment.sensitivities.empty() && experiment.ground_truth_file.empty()) {
      throw InputError(place("reference"), document.value("reference", json()).dump(),
                       "sensitivities are measured against a \"ground_truth\"");
    }
    const json grids = document.value("grids", json::object());
    for (const auto& entry : document.at("methods")) {
      Experiment::MethodGrid method;
      method.method = entry.at("method");
      method.on_failure = entry.value("on_failure", "");
      if (entry.contains("steps")) method.steps = read_steps(entry["steps"], grids, place("steps of " + method.method));
      if (entry.contains("tolerances")) method.tolerances = entry["tolerances"].get<std::vector<double>>();
      method.not_built = why_not_built(method.method);
      const bool is_adaptive =
          method.not_built.empty() ? make_method(method.method)->info().is_adaptive : method.steps.empty();
      if (is_adaptive ? method.tolerances.empty() : method.steps.empty()) {
        throw InputError(place("methods"), method.method,
                         is_adaptive ? "\"tolerances\" are required" : "\"steps\" are required");
      }
      experiment.methods.push_back(std::move(method));
    }
    if (document.contains("trajectory")) {
      experiment.trajectory_method = document["trajectory"].at("method");
      experiment.trajectory_steps = document["trajectory"].at("steps");
    }
    experiment.overhead_of = document.value("overhead_of", std::map<std::string, std::string>{});
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not an experiment: {}", path, error.what()));
  }
  return experiment;
}

std::unique_ptr<Problem> Experiment::make_problem() const {
  const bool is_file = problem.find(".json") != std::string::npos;
  return is_file
             ? read_scene_file(find_project_file(problem.substr(0, problem.rfind('#'))) +
                                   (problem.find('#') == std::string::npos ? "" : problem.substr(problem.rfind('#'))),
                               parameters)
             : ricochet::make_problem(problem, parameters);
}

reference::Reference Experiment::make_reference(const Problem& the_problem) const {
  if (ground_truth_file.empty()) return reference::make_reference(the_problem);
  const auto truth = reference::read_ground_truth(find_project_file(ground_truth_file), ground_truth_case);
  reference::Reference reference;
  reference.solution = truth.solution(sensitivities);
  // 42 decimals of the state, 27 and more of its derivatives, rounded to double.
  reference.uncertainty = std::numeric_limits<double>::epsilon() * reference.size();
  reference.how = fmt::format("{}, {}", ground_truth_file, ground_truth_case);
  return reference;
}

}  // namespace ricochet
