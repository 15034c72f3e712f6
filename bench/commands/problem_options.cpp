#include "bench/commands/problem_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>

#include "bench/commands/number_checks.h"
#include "bench/measure/measure_run.h"
#include "methods/initial_state.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/expression.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {

void ProblemOptions::add_problem(CLI::App& command) {
  auto* by_id = command.add_option("--problem,-p", problem, "name of a problem, see `ricochet list problems`");
  auto* by_file =
      command.add_option("--scene,-s", scene, "scene FILE.json, or FILE.json#ID if the file contains several scenes");
  by_id->excludes(by_file);
  command.add_option("--set", changes, "NAME=VALUE: set a parameter of the problem; may be repeated")
      ->allow_extra_args(false);
  auto* moved =
      command
          .add_option(
              "--allow-penetration", depth,
              "accept an initial penetration of up to DEPTH metres, as in measured data: move the position to the "
              "nearest one without penetration, in the norm of M, and print the change")
          ->check(non_negative_number());
  command
      .add_option("--keep-penetration", kept_depth,
                  "keep an initial penetration of up to DEPTH metres and let the method resolve it")
      ->check(non_negative_number())
      ->excludes(moved);
  command
      .add_option("--until", until,
                  "end the run where FORMULA of q[i], v[i], t and the parameters vanishes, such as 'q[1]-0.3'")
      ->option_text("FORMULA");
  command.add_option("--impact-law", impact_law,
                     "replace the impact law of the scene: newton, poisson, routh, stronge or lzb");
}

void ProblemOptions::add_settings(CLI::App& command) {
  command_ = &command;
  auto* number = command.add_option("--steps,-N", steps, "number of steps (fixed-step methods)");
  command
      .add_option("--step-length", step_length,
                  "length of a step in seconds; it must divide the end time (fixed-step methods)")
      ->excludes(number);
  command.add_option("--tolerance", tolerance, "tolerance (error-controlled methods)");
  command.add_option("--time-limit", time_limit, "limit of the wall time in seconds; 0 for none")
      ->check(non_negative_number());
}

namespace {

/// The value of a `change` NAME=VALUE, which begins at a character: a number, or a formula of numbers.
double changed_value(const std::string& change, std::size_t begin) {
  double value = 0;
  const char* const end = change.data() + change.size();
  const auto [rest, error] = std::from_chars(change.data() + begin, end, value);
  if (error == std::errc() && rest == end) return value;
  try {
    return formula_value(change.substr(begin), {}, "--set");
  } catch (const InputError&) {
    throw InputError("--set", change, "the value must be a number or a formula of numbers, such as 1/2");
  }
}

}  // namespace

ParameterChanges parameter_changes(const std::vector<std::string>& changes) {
  ParameterChanges parameters;
  for (const auto& change : changes) {
    const auto equals = change.find('=');
    if (equals == std::string::npos || equals == 0) throw InputError("--set", change, "NAME=VALUE is required");
    if (!parameters.emplace(change.substr(0, equals), changed_value(change, equals + 1)).second)
      throw InputError("--set", change, "this parameter is given twice");
  }
  return parameters;
}

std::unique_ptr<Problem> ProblemOptions::make_problem() const {
  const ParameterChanges parameters = parameter_changes(changes);
  if (scene.empty() && problem.empty())
    throw InputError("--problem", "''", "a scene id, or --scene with a file, is required");
  const double most = std::max(depth, kept_depth);
  auto made =
      scene.empty() ? ricochet::make_problem(problem, parameters, most) : read_scene_file(scene, parameters, most);
  if (!until.empty()) made = with_until(*made, until);
  if (!impact_law.empty()) {
    ImpactLaw law = made->info().impact_law;
    law.hypothesis = impact_hypothesis(impact_law);
    made->set_impact_law(std::move(law));
    validate(*made, most);
  }
  if (depth > 0) {
    auto [projected, note] = project_initial_state(std::move(made));
    if (!note.empty()) fmt::print(stderr, "note       {}\n", note);
    return std::move(projected);
  }
  return made;
}

bool ProblemOptions::is_given(const std::string& option) const {
  return command_ && command_->count(option) > 0;
}

Settings ProblemOptions::settings(const Problem& the_problem, const Method& method) const {
  const std::string number = is_given("--steps") ? "--steps" : is_given("--step-length") ? "--step-length" : "";
  require_kind_of_setting(method, number, is_given("--tolerance") ? "--tolerance" : "");
  Settings settings;
  settings.steps = steps;
  if (number == "--step-length") {
    const double count = the_problem.info().end_time / step_length;
    if (!(step_length > 0) || !std::isfinite(step_length) || count > 1e9 ||
        std::abs(count - std::round(count)) > 1e-9 * count) {
      throw InputError("--step-length", step_length,
                       fmt::format("a positive number that divides T = {} is required", the_problem.info().end_time));
    }
    settings.steps = static_cast<int>(std::lround(count));
  }
  settings.tolerance = tolerance;
  settings.time_limit = time_limit;
  return settings;
}

}  // namespace ricochet
