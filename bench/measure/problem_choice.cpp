#include "bench/measure/problem_choice.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>

#include "bench/measure/data_folder.h"
#include "problems/scene_file/scene_file.h"
#include "reference/proven.h"
#include "reference/truths.h"

namespace ricochet {

namespace {

/// FILE#ID with the file found in the folder of data.
std::string found_scene(const std::string& problem) {
  const auto hash = problem.rfind('#');
  const std::string scene = hash == std::string::npos ? "" : problem.substr(hash);
  return find_project_file(problem.substr(0, hash)) + scene;
}

}  // namespace

std::unique_ptr<Problem> ProblemChoice::make_problem() const {
  if (!is_scene_file()) return ricochet::make_problem(problem, parameters);
  return read_scene_file(found_scene(problem), parameters);
}

std::optional<reference::GroundTruth> ProblemChoice::truth() const {
  if (is_changed) return std::nullopt;
  return reference::known_solution(is_scene_file() ? found_scene(problem) : problem, parameters);
}

reference::Reference ProblemChoice::make_reference(const Problem& made,
                                                   const std::vector<std::string>& sensitivities) const {
  const auto known = truth();
  if (!known && !sensitivities.empty())
    throw std::logic_error("a computed reference has no derivatives of the final state");
  if (!known) return reference::truth_of(made);
  reference::Reference reference;
  reference.solution = known->solution(sensitivities);
  // 42 decimals of the state, 27 and more of its derivatives, rounded to double.
  reference.uncertainty = std::numeric_limits<double>::epsilon() * reference.size();
  reference.is_truth = true;
  reference.how = fmt::format(
      "{}, {}", is_scene_file() ? problem.substr(0, problem.rfind('#')) : reference::kCertifiedFile, known->id);
  return reference;
}

ProblemChoice read_problem_choice(const nlohmann::json& experiment) {
  ProblemChoice choice;
  choice.problem = experiment.at("problem");
  choice.parameters = experiment.value("parameters", ParameterChanges{});
  return choice;
}

}  // namespace ricochet
