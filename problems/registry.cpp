#include "problems/registry.h"

#include "problems/initial_state.h"
#include "problems/names.h"

namespace ricochet {
namespace {

std::map<std::string, SceneEntry>& entries() {
  static std::map<std::string, SceneEntry> entries;
  return entries;
}

}  // namespace

bool add_scene(SceneEntry entry) {
  const std::string id = entry.id;
  const bool is_new = entries().emplace(id, std::move(entry)).second;
  if (!is_new) throw std::logic_error("two scenes are registered as " + id);
  return true;
}

std::vector<SceneEntry> scenes() {
  std::vector<SceneEntry> list;
  for (const auto& [id, entry] : entries()) list.push_back(entry);
  return list;
}

std::vector<ParameterInfo> parameters_of(const SceneEntry& scene) {
  return scene.parameters.empty() ? scene.make({})->info().parameters : scene.parameters;
}

std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes) {
  return make_problem(id, changes, 0);
}

std::unique_ptr<Problem> make_problem(const std::string& id, const ParameterChanges& changes, double depth) {
  const auto entry = entries().find(id);
  if (entry == entries().end()) throw_unknown_name("problem", id, keys_of(entries()));
  auto problem = entry->second.make(changes);
  validate(*problem, depth);
  return problem;
}

}  // namespace ricochet
