#include "reference/truths.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "problems/input_text.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet::reference {

extern const char* const kCertifiedCases;  // the text of kCertifiedFile, by CMake

namespace {

using nlohmann::json;

const json& certified_document() {
  static const json document = json::parse(kCertifiedCases);
  return document;
}

std::vector<SceneEntry> certified_scenes() {
  std::vector<SceneEntry> list;
  for (const json& known : certified_document().at("cases")) {
    SceneEntry scene{known.at("id"), known.at("title"), known.at("source"), known.at("hard_feature"), nullptr};
    scene.solution = fmt::format("known to {} decimals, by {}", known.at("certified_decimals").get<int>(),
                                 known.at("method").get<std::string>());
    json stated;
    for (const char* field : {"id", "title", "source", "hard_feature", "problem"}) stated[field] = known.at(field);
    scene.make = [text = stated.dump(), id = scene.id](const ParameterChanges& changes) {
      return read_scene_text(text, id, changes);
    };
    list.push_back(std::move(scene));
  }
  return list;
}

const bool registered = add_scenes(certified_scenes);

/// Whether every changed parameter has the value that it has by default.
bool are_defaults(const SceneEntry& scene, const ParameterChanges& changes) {
  const auto parameters = parameters_of(scene);
  return std::ranges::all_of(changes, [&](const auto& change) {
    const auto known = std::ranges::find(parameters, change.first, &ParameterInfo::name);
    return known != parameters.end() && known->value == change.second;
  });
}

/// The certified case that is the scene, or has the same motion.
const json* case_of(const std::string& scene) {
  for (const json& known : certified_document().at("cases")) {
    const auto same = known.value("same_as", std::vector<std::string>());
    if (known.at("id") == scene || std::ranges::find(same, scene) != same.end()) return &known;
  }
  return nullptr;
}

/// The case ID of FILE.json#ID, if it states a solution.
std::optional<GroundTruth> truth_in_file(const std::string& path, const std::string& id) {
  const json document = read_input_json(path, "scene file");
  if (!document.is_object() || !document.contains("cases")) return std::nullopt;
  for (const json& known : document["cases"]) {
    if (known.is_object() && known.value("id", "") == id && known.contains("final"))
      return ground_truth_of({{"cases", {known}}}, path).front();
  }
  return std::nullopt;
}

}  // namespace

const std::vector<GroundTruth>& certified_cases() {
  static const auto cases = ground_truth_of(certified_document(), kCertifiedFile);
  return cases;
}

std::optional<GroundTruth> known_solution(const std::string& problem, const ParameterChanges& parameters) {
  if (problem.find(".json") != std::string::npos) {
    const auto hash = problem.rfind('#');
    if (hash == std::string::npos || !parameters.empty()) return std::nullopt;
    return truth_in_file(problem.substr(0, hash), problem.substr(hash + 1));
  }
  const json* const known = case_of(problem);
  if (known == nullptr) return std::nullopt;
  const auto list = scenes();
  const auto scene = std::ranges::find(list, problem, &SceneEntry::id);
  if (scene == list.end() || !are_defaults(*scene, parameters)) return std::nullopt;
  return *std::ranges::find(certified_cases(), known->at("id").get<std::string>(), &GroundTruth::id);
}

std::string picture_of(const std::string& scene) {
  const json* const known = case_of(scene);
  return known != nullptr && known->at("id") == scene ? known->at("picture").dump() : "";
}

}  // namespace ricochet::reference
