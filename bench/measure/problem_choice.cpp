#include "bench/measure/problem_choice.h"

#include <fmt/format.h>

#include <limits>

#include "bench/experiment/experiment_file.h"
#include "problems/scene_file/scene_file.h"
#include "reference/ground_truth.h"

namespace ricochet {

std::unique_ptr<Problem> ProblemChoice::make_problem() const {
  if (!is_scene_file()) return ricochet::make_problem(problem, parameters);
  const auto hash = problem.rfind('#');
  const std::string scene = hash == std::string::npos ? "" : problem.substr(hash);
  return read_scene_file(find_project_file(problem.substr(0, hash)) + scene, parameters);
}

reference::Reference ProblemChoice::make_reference(const Problem& made,
                                                   const std::vector<std::string>& sensitivities) const {
  if (ground_truth_file.empty()) return reference::make_reference(made);
  const auto truth = reference::read_ground_truth(find_project_file(ground_truth_file), ground_truth_case);
  reference::Reference reference;
  reference.solution = truth.solution(sensitivities);
  // 42 decimals of the state, 27 and more of its derivatives, rounded to double.
  reference.uncertainty = std::numeric_limits<double>::epsilon() * reference.size();
  reference.how = fmt::format("{}, {}", ground_truth_file, ground_truth_case);
  return reference;
}

std::string ProblemChoice::arguments() const {
  std::string text = fmt::format("--{} {}", is_scene_file() ? "scene" : "problem", problem);
  for (const auto& [name, value] : parameters) text += fmt::format(" --set {}={}", name, value);
  return text;
}

std::string run_command(const std::string& scene, const std::string& method, int steps, double tolerance) {
  const std::string setting = steps > 0 ? fmt::format("--steps {}", steps) : fmt::format("--tolerance {}", tolerance);
  return fmt::format("ricochet run {} --method {} {}", scene, method, setting);
}

std::string setting_text(int steps, double tolerance) {
  return steps > 0 ? fmt::format("-N {}", steps) : fmt::format("--tolerance {:.2g}", tolerance);
}

ProblemChoice read_problem_choice(const nlohmann::json& experiment) {
  ProblemChoice choice;
  choice.problem = experiment.at("problem");
  choice.parameters = experiment.value("parameters", ParameterChanges{});
  if (const auto reference = experiment.find("reference"); reference != experiment.end() && !reference->is_null()) {
    choice.ground_truth_file = reference->at("ground_truth");
    choice.ground_truth_case = reference->at("case");
  }
  return choice;
}

}  // namespace ricochet
