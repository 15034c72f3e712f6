#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "problems/names.h"
#include "problems/registry.h"
#include "problems/scene.h"

namespace ricochet {

/// Parameters of an assembled scene by name: the defaults, with changes of the user.
class SceneParameters {
 public:
  /// @throws InputError for an unknown name
  SceneParameters(const std::string& scene, std::vector<ParameterInfo> defaults, const ParameterChanges& changes)
      : parameters_(std::move(defaults)) {
    for (const auto& [name, value] : changes) {
      const auto at = std::ranges::find(parameters_, name, &ParameterInfo::name);
      if (at == parameters_.end()) {
        std::vector<std::string> known;
        for (const auto& parameter : parameters_) known.push_back(parameter.name);
        throw_unknown_name("parameter of " + scene, name, known);
      }
      at->value = value;
    }
  }

  double operator[](const std::string& name) const {
    return std::ranges::find(parameters_, name, &ParameterInfo::name)->value;
  }
  /// @throws InputError when it is not a whole number from min to max
  int count(const std::string& name, int min, int max) const {
    const double value = (*this)[name];
    if (!(value >= min && value <= max && value == std::floor(value)))
      throw InputError("params." + name, value, fmt::format("a whole number from {} to {} is required", min, max));
    return static_cast<int>(value);
  }
  /// @throws InputError when it is not a finite number > 0
  double positive(const std::string& name) const {
    const double value = (*this)[name];
    if (!(value > 0) || !std::isfinite(value))
      throw InputError("params." + name, value, "a finite number > 0 is required");
    return value;
  }

 private:
  std::vector<ParameterInfo> parameters_;
};

/// Registers an assembled scene under its id, with its parameters. Call once, in the file of the scene.
/// @param file  file of the caller; std::source_location is missing in Clang before version 16
inline bool register_assembled_scene(const SceneText& text, const std::vector<ParameterInfo>& parameters,
                                     std::unique_ptr<Problem> (*make)(const SceneParameters&),
                                     const char* file = __builtin_FILE()) {
  const auto make_changed = [text, parameters, make](const ParameterChanges& changes) {
    return make(SceneParameters(text.id, parameters, changes));
  };
  return add_scene({text.id, text.title, text.source, text.hard_feature, make_changed, parameters, file});
}

}  // namespace ricochet
