#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "problems/registry.h"

namespace ricochet {

/// Parameters of an assembled scene by name: the defaults with a user's changes.
class SceneParameters {
 public:
  /// @throws InputError for a change of a name that is not there
  SceneParameters(const std::string& scene, std::vector<std::pair<std::string, double>> defaults,
                  const ParameterChanges& changes)
      : values_(std::move(defaults)) {
    for (const auto& [name, value] : changes) {
      const auto at = std::ranges::find(values_, name, &std::pair<std::string, double>::first);
      if (at == values_.end()) {
        std::vector<std::string> known;
        for (const auto& [its_name, its_value] : values_) known.push_back(its_name);
        throw InputError("parameter", name,
                         fmt::format("known parameters of {} are {}", scene, fmt::join(known, ", ")));
      }
      at->second = value;
    }
  }

  double operator[](const std::string& name) const {
    return std::ranges::find(values_, name, &std::pair<std::string, double>::first)->second;
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
  std::vector<std::pair<std::string, double>> values_;
};

}  // namespace ricochet
