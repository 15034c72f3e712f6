#include "problems/registry.h"

#include <utility>

#include "problems/initial_state.h"
#include "problems/names.h"

namespace ricochet {
namespace {

struct Registry {
  std::map<std::string, SceneEntry> entries;
  std::vector<std::function<std::vector<SceneEntry>()>> unread;  ///< lists of scenes that are read on first use

  void add(SceneEntry entry) {
    const std::string id = entry.id;
    if (!entries.emplace(id, std::move(entry)).second) throw std::logic_error("two scenes are registered as " + id);
  }
};

Registry& registry() {
  static Registry registry;
  return registry;
}

const std::map<std::string, SceneEntry>& entries() {
  Registry& all = registry();
  for (const auto& read : std::exchange(all.unread, {})) {
    for (auto& entry : read()) all.add(std::move(entry));
  }
  return all.entries;
}

}  // namespace

bool add_scene(SceneEntry entry) {
  registry().add(std::move(entry));
  return true;
}

bool add_scenes(std::function<std::vector<SceneEntry>()> read) {
  registry().unread.push_back(std::move(read));
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
