#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

struct Case {
  const char *id, *title;
  int certified_decimals;
  const char *method, *scene;
};

// id, title, certified decimals, what they were computed by, and scene of every case, taken from
// tests/data/ground_truth.json by CMake.
const Case cases[] = {
#include "ground_truth_cases.inc"
};

bool register_cases() {
  for (const Case& known : cases) {
    // Its source is a file, where bench/known_truth.cpp finds the solution.
    SceneEntry entry{known.id, known.title, "tests/data/ground_truth.json",
                     fmt::format("the solution is known to {} decimals, by {}", known.certified_decimals, known.method),
                     nullptr};
    const nlohmann::json document = {{"id", entry.id},
                                     {"title", entry.title},
                                     {"source", entry.source},
                                     {"hard_feature", entry.hard_feature},
                                     {"problem", nlohmann::json::parse(known.scene)}};
    entry.make = [text = document.dump(), id = entry.id](const ParameterChanges& changes) {
      return read_scene_text(text, id, changes);
    };
    add_scene(std::move(entry));
  }
  return true;
}

const bool registered = register_cases();

}  // namespace
}  // namespace ricochet
