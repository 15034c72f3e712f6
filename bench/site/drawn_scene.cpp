#include "bench/site/drawn_scene.h"

#include <nlohmann/json.hpp>
#include <string>

#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "reference/truths.h"

namespace ricochet {

std::unique_ptr<Problem> with_picture(const Problem& problem) {
  const std::string picture = reference::picture_of(problem.info().id);
  if (picture.empty()) return nullptr;
  nlohmann::json scene = nlohmann::json::parse(scene_text(problem));
  scene.at("problem")["geometry"] = nlohmann::json::parse(picture);
  return read_scene_text(scene.dump(), reference::kCertifiedFile);
}

}  // namespace ricochet
