#include "bench/measure/known_truth.h"

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/studies/study.h"
#include "problems/input_error.h"
#include "reference/ground_truth.h"

namespace ricochet {
namespace {

bool has_truth(const std::string& file, const std::string& id) {
  try {
    reference::read_ground_truth(find_project_file(file), id);
    return true;
  } catch (const InputError&) {  // a scene file like any other
    return false;
  }
}

/// The file and the case that a problem without changes is from.
std::pair<std::string, std::string> origin(const ProblemChoice& choice) {
  if (const auto hash = choice.problem.rfind('#'); choice.is_scene_file() && hash != std::string::npos)
    return {choice.problem.substr(0, hash), choice.problem.substr(hash + 1)};
  for (const auto& scene : scenes()) {
    if (scene.id == choice.problem && scene.source.ends_with(".json")) return {scene.source, scene.id};
  }
  return {};
}

}  // namespace

void find_ground_truth(ProblemChoice& choice) {
  if (const auto [file, id] = origin(choice); choice.parameters.empty() && !file.empty() && has_truth(file, id)) {
    choice.ground_truth_file = file;
    choice.ground_truth_case = id;
    return;
  }
  for (const auto& name : experiment_names()) {
    ExperimentFile experiment = read_experiment_file(name);
    nlohmann::json& document = experiment.document;
    if (experiment.kind() != kDefaultStudy || document.contains("parts")) continue;
    experiment.take_quick_part(false);
    resolve_paths(document, experiment_schema(find_study(kDefaultStudy)),
                  std::filesystem::path(experiment.path).parent_path());
    const ProblemChoice known = read_problem_choice(document);
    if (known.problem != choice.problem || known.parameters != choice.parameters || known.ground_truth_file.empty())
      continue;
    choice.ground_truth_file = known.ground_truth_file;
    choice.ground_truth_case = known.ground_truth_case;
    return;
  }
}

}  // namespace ricochet
