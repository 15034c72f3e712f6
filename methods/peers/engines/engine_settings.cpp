#include "methods/peers/engines/engine_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "problems/input_error.h"
#include "problems/input_text.h"

namespace ricochet {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> names_of(const std::vector<EngineSetting>& settings) {
  std::vector<std::string> names;
  for (const EngineSetting& setting : settings) names.push_back(setting.name);
  return names;
}

}  // namespace

EngineSettings::EngineSettings(const char* known, const std::string& choice) {
  const Json list = Json::parse(known);
  nlohmann::json mine = nlohmann::json::object();
  std::string base = choice;
  if (choice != "defaults" && choice != "tuned") {
    if (!choice.starts_with('@')) throw InputError("settings", choice, "defaults, tuned or @FILE.json is required");
    mine = read_input_json(choice.substr(1), "settings of an engine");
    if (!mine.is_object()) throw InputError("settings", choice, "an object is required, {\"settings\": {...}}");
    base = mine.value("base", "defaults");
    if (base != "defaults" && base != "tuned") throw InputError("base", base, "defaults or tuned is required");
    for (const auto& [key, value] : mine.items()) {
      if (key != "base" && key != "settings") throw InputError(key, choice, "base and settings are known");
    }
    mine = mine.value("settings", nlohmann::json::object());
    if (!mine.is_object()) throw InputError("settings", choice, "an object of numbers is required");
  }
  engine_ = list.at("engine");
  for (const auto& [name, setting] : list.at("settings").items()) {
    const double value = setting.at("default"), tuned = setting.value("tuned", value);
    const bool is_tuned = base == "tuned" && tuned != value;
    all_.push_back({name, is_tuned ? tuned : value, is_tuned ? setting.value("reason", "") : ""});
  }
  for (const auto& [name, value] : mine.items()) {
    const auto changed = std::find_if(all_.begin(), all_.end(), [&](const auto& s) { return s.name == name; });
    if (changed == all_.end())
      throw InputError(name, choice, fmt::format("{} has {}", engine_, fmt::join(names_of(all_), ", ")));
    if (!value.is_number()) throw InputError(name, value.dump(), "a number is required");
    *changed = {name, value, fmt::format("'{}' says so", choice)};
  }
}

double EngineSettings::operator[](const std::string& name) const {
  for (const EngineSetting& setting : all_) {
    if (setting.name == name) return setting.value;
  }
  throw std::logic_error(fmt::format("no setting '{}' in the list of {}", name, engine_));
}

}  // namespace ricochet
