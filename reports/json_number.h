#pragma once

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace ricochet {

// JSON has no NaN: null stands for "no number".

inline nlohmann::json number_or_null(double x) {
  return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json();
}
inline double number_or_nan(const nlohmann::json& j) {
  return j.is_number() ? j.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace ricochet
