#include "bench/fuzz/evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "bench/fuzz/minimise.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using nlohmann::ordered_json;

struct Evidence {
  std::string claim;  ///< a phrase
  SceneTest test;     ///< whether another scene shows it, too
};

FuzzResult run_again(const ordered_json& scene, const FuzzResult& result, double time_limit) {
  return run_method(*read_scene_text(scene.dump(), "scene"), result.method, result.setting, time_limit);
}

Evidence evidence_of(const FuzzScene& found, const JudgeOptions& options) {
  if (found.verdict == FuzzVerdict::disagree || found.verdict == FuzzVerdict::wrong) {
    const std::string claim = found.verdict == FuzzVerdict::wrong ? "a method is wrong: " : "methods disagree: ";
    return {claim + found.detail,
            [verdict = found.verdict, parties = found.parties, options](const ordered_json& scene) {
              const FuzzScene again = judge(scene, options);
              return again.verdict == verdict && again.parties == parties;
            }};
  }
  const auto hanging =
      std::ranges::find_if(found.results, [](const FuzzResult& result) { return result.is_killed_or_crashed(); });
  if (hanging != found.results.end()) {
    constexpr double time_limit = 1;  // a scene that hangs does so for a second, too
    return {found.detail, [result = *hanging](const ordered_json& scene) {
              return run_again(scene, result, time_limit).status == result.status;
            }};
  }
  const FuzzResult& adaptive = found.results.front();
  if (!adaptive.succeeded()) {
    return {"fesd_adaptive declines: " + adaptive.message, [adaptive, options](const ordered_json& scene) {
              const FuzzResult again = run_again(scene, adaptive, options.time_limit);
              return !again.succeeded() && again.reason_class() == adaptive.reason_class();
            }};
  }
  return {};
}

}  // namespace

std::string save_evidence(const ordered_json& scene, const FuzzScene& found, const std::string& folder, double seconds,
                          const JudgeOptions& options) {
  const Evidence evidence = evidence_of(found, options);
  if (!evidence.test) return "";
  ordered_json smallest = minimise(scene, evidence.test, seconds);
  smallest["source"] = fmt::format("scene {} of `ricochet fuzz --family {} --seed {}`, minimised", found.number,
                                   found.family, found.seed);
  smallest["hard_feature"] = evidence.claim;
  const std::string path =
      (std::filesystem::path(folder) / fmt::format("{}_{}_{}.json", found.family, found.seed, found.number)).string();
  std::string text = fmt::format("// ricochet fuzz --scene {0}\n// ricochet truth --scene {0}\n", path);
  for (const auto& result : found.results) text += fmt::format("// {}\n", result.command(path));
  write_text("scene file", path, text + smallest.dump(1) + "\n");
  return path;
}

}  // namespace ricochet
