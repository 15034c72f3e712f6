#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

/// @file
/// Columns of balls whose impacts accumulate, computed event by event in Python with 100 and 160 digits.

namespace ricochet::reference::certified {

inline constexpr const char* kCollapses = RICOCHET_REFERENCE_DATA "/collapses.json";

/// What the file states of the case `id`.
inline nlohmann::json stated_collapse(const std::string& id) {
  std::ifstream file(kCollapses);
  const auto document = nlohmann::json::parse(file);
  for (const auto& entry : document["cases"]) {
    if (entry["id"] == id) return entry;
  }
  throw std::runtime_error("no case " + id);
}

}  // namespace ricochet::reference::certified
