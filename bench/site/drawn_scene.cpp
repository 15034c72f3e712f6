#include "bench/site/drawn_scene.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/experiment/data_folder.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using nlohmann::json;

const char* const kPictures = "problems/scene_file/ground_truth_pictures.json";

/// Read once; null where there is no such file.
const json& pictures() {
  static const json list = [] {
    const std::string text = read_text(std::filesystem::path(data_folder()) / kPictures);
    return text.empty() ? json() : json::parse(text).at("pictures");
  }();
  return list;
}

}  // namespace

std::unique_ptr<Problem> with_picture(const Problem& problem) {
  for (const json& picture : pictures()) {
    const auto cases = picture.at("cases").get<std::vector<std::string>>();
    if (std::ranges::find(cases, problem.info().id) == cases.end()) continue;
    json scene = json::parse(scene_text(problem));
    scene.at("problem")["geometry"] = picture.at("geometry");
    return read_scene_text(scene.dump(), kPictures);
  }
  return nullptr;
}

}  // namespace ricochet
