#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "bench/fuzz/fuzz_scene.h"
#include "bench/fuzz/judge.h"

namespace ricochet {

/// Saves a scene on which methods disagree, one of them hangs, or fesd_adaptive declines.
/// The scene is minimised while this finding remains, and saved with the command lines that repeat it as comments at the
/// top.
/// @param scene   of a scene file
/// @param found   verdict of judge()
/// @param seconds wall time that the minimiser may take
/// @return the path of the file; empty if the scene has no such finding
std::string save_evidence(const nlohmann::ordered_json& scene, const FuzzScene& found, const std::string& folder,
                          double seconds, const JudgeOptions& options);

}  // namespace ricochet
