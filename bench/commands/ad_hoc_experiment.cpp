#include "bench/commands/ad_hoc_experiment.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "bench/commands/problem_options.h"
#include "bench/measure/problem_choice.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/split.h"

namespace ricochet {
namespace {

using nlohmann::json;

// One of each family: time stepping, FESD-J, and two that locate events.
const std::vector<std::string> kUsualMethods = {"moreau_jean", "fesd:radau-iia:3,elements=as_needed", "event_driven",
                                                "cvode:adams"};
// A method of first order needs a hundred times as many.
constexpr const char *kUsualSteps = "10..1000", *kUsualFirstOrderSteps = "1000..100000",
                     *kUsualTolerances = "1e-3..1e-9";
// An order is fitted to a decade and more; a run to a tolerance is one point of it.
constexpr double kStepsPerDecade = 8, kTolerancesPerDecade = 1;

constexpr std::size_t kMethodsInName = 3;

double number_of(const std::string& text, const std::string& option, const std::string& given) {
  std::size_t end = 0;
  double value = 0;
  try {
    value = std::stod(text, &end);
  } catch (const std::logic_error&) {  // no number, or one that no double holds
    end = std::string::npos;
  }
  if (end != text.size() || text.empty())
    throw InputError(option, given, "FROM..TO, FROM..TO:PER_DECADE or A,B,... in numbers is required");
  return value;
}

/// "FROM..TO:PER_DECADE" as the range of an experiment file, "A,B" as a list of numbers.
json settings_of(const std::string& text, const std::string& option, double usual_per_decade) {
  const auto dots = text.find("..");
  if (dots == std::string::npos) {
    json list = json::array();
    for (const auto& part : split(text, ',')) list.push_back(number_of(part, option, text));
    return list;
  }
  const auto colon = text.find(':', dots);
  const std::string to = text.substr(dots + 2, colon == std::string::npos ? colon : colon - dots - 2);
  return {
      {"from", number_of(text.substr(0, dots), option, text)},
      {"to", number_of(to, option, text)},
      {"per_decade", colon == std::string::npos ? usual_per_decade : number_of(text.substr(colon + 1), option, text)}};
}

/// Numbers of steps; a range stays one.
json steps_of(const std::string& text) {
  json steps = settings_of(text, "--steps", kStepsPerDecade);
  if (steps.is_object()) {
    logarithmic_grid(steps, "--steps");  // a bad one throws here
    return steps;
  }
  for (json& number : steps) {
    const double value = number;
    if (!(value >= 1 && value <= 1e9) || value != static_cast<int>(value))
      throw InputError("--steps", text, "whole numbers >= 1 are required");
    number = static_cast<int>(value);
  }
  return steps;
}

/// An experiment file lists its tolerances.
json tolerances_of(const std::string& text) {
  const json given = settings_of(text, "--tolerance", kTolerancesPerDecade);
  std::vector<double> list =
      given.is_object() ? logarithmic_grid(given, "--tolerance") : given.get<std::vector<double>>();
  for (double& tolerance : list) {
    tolerance = std::stod(fmt::format("{:.6g}", tolerance));  // 1e-5, and not what 1e-3 * 10^-2 is rounded to
    if (!(tolerance >= 1e-15 && tolerance < 1))
      throw InputError("--tolerance", text, "numbers >= 1e-15 and < 1 are required");
  }
  return list;
}

std::string or_usual(const std::string& given, const char* usual) {
  return given.empty() ? usual : given;
}

/// @throws InputError for a setting that no method looks at
void require_taken(const std::string& option, const std::string& given, bool is_taken,
                   const std::vector<std::string>& methods) {
  if (!given.empty() && !is_taken)
    throw InputError(option, given, fmt::format("none of the methods supports it: {}", fmt::join(methods, "  ")));
}

/// "NAME,PARAMETER=VALUE,...".
ProblemChoice choice_of(const AdHocStudy& study) {
  const bool is_scene = !study.scene.empty();
  std::vector<std::string> parts = split(is_scene ? study.scene : study.problem, ',');
  ProblemChoice choice;
  choice.problem = parts.front();
  choice.parameters = parameter_changes({parts.begin() + 1, parts.end()});
  if (is_scene != choice.is_scene_file())
    throw InputError(is_scene ? "--scene" : "--problem", choice.problem,
                     is_scene ? "a file FILE.json or FILE.json#ID is required" : "scene files are for --scene");
  choice.make_problem();  // a bad one throws here
  return choice;
}

/// The text as a file name: other characters are replaced.
std::string file_name_of(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool is_kept = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '=' || c == '.' || c == '-';
    name += is_kept ? c : '-';
  }
  return name;
}

/// "bouncing_ball-e=0.9_moreau_jean_fesd-gauss-2_steps-10..1000".
std::string id_of(const AdHocStudy& study, const std::vector<std::string>& methods) {
  std::string id = study.problem;
  if (!study.scene.empty()) {
    id = std::filesystem::path(study.scene).filename();
    id.erase(id.find(".json"), 5);
  }
  for (std::size_t k = 0; k < std::min(methods.size(), kMethodsInName); ++k) id += "_" + methods[k];
  if (methods.size() > kMethodsInName) id += fmt::format("_and_{}", methods.size() - kMethodsInName);
  if (!study.steps.empty()) id += "_steps-" + study.steps;
  if (!study.tolerances.empty()) id += "_tolerance-" + study.tolerances;
  return file_name_of(id);
}

std::string arguments_of(const AdHocStudy& study) {
  std::string text =
      study.scene.empty() ? fmt::format("--problem {}", study.problem) : fmt::format("--scene {}", study.scene);
  for (const auto& method : study.methods) text += " --method " + method;
  if (!study.steps.empty()) text += " --steps " + study.steps;
  if (!study.tolerances.empty()) text += " --tolerance " + study.tolerances;
  return text;
}

}  // namespace

ExperimentFile ad_hoc_experiment(const AdHocStudy& study) {
  if (study.scene.empty() && study.problem.empty())
    throw InputError("experiment", "''", "a name, or --problem or --scene for one without a file, is required");
  const ProblemChoice choice = choice_of(study);
  const std::vector<std::string> methods = study.methods.empty() ? kUsualMethods : study.methods;
  bool takes_steps = false, takes_tolerances = false;
  json entries = json::array();
  for (const auto& spec : methods) {
    const MethodInfo info = make_method(spec)->info();
    (info.is_adaptive ? takes_tolerances : takes_steps) = true;
    if (info.is_adaptive)
      entries.push_back(
          {{"method", spec}, {"tolerances", tolerances_of(or_usual(study.tolerances, kUsualTolerances))}});
    else
      entries.push_back(
          {{"method", spec},
           {"steps", steps_of(or_usual(study.steps, info.order_impacts <= 1 ? kUsualFirstOrderSteps : kUsualSteps))}});
  }
  require_taken("--steps", study.steps, takes_steps, methods);
  require_taken("--tolerance", study.tolerances, takes_tolerances, methods);
  const std::string arguments = arguments_of(study);
  json document = {{"id", id_of(study, methods)},
                   {"kind", "method_grid"},
                   {"title", fmt::format("Methods on {}", study.scene.empty() ? study.problem : study.scene)},
                   {"description", fmt::format("`ricochet run-experiment {}`", arguments)},
                   {"problem", choice.problem},
                   {"methods", entries}};
  if (!choice.parameters.empty()) document["parameters"] = choice.parameters;
  return ExperimentFile(arguments, "command line", document);
}

}  // namespace ricochet
