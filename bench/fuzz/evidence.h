#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "bench/fuzz/fuzz_scene.h"
#include "bench/fuzz/judge.h"

namespace ricochet {

/// What a scene is kept for: that methods disagree on it, that one of them hangs, or that fesd_adaptive declines it.
/// The scene is minimised while this remains, and saved with the command lines that repeat it as comments at the top.
/// @param scene   of a scene file
/// @param found   what judge() said of it
/// @param seconds wall time that the minimiser may take
/// @return the path of the file; empty when the scene shows nothing of the kind
std::string save_evidence(const nlohmann::ordered_json& scene, const FuzzScene& found, const std::string& folder,
                          double seconds, const JudgeOptions& options);

}  // namespace ricochet
