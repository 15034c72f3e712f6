#include "reports/setting.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace ricochet {

std::string Setting::value() const {
  if (!is_tolerance()) return fmt::format("{}", steps);
  const std::string power = fmt::format("{:.0e}", tolerance);  // "1e-08"
  const bool is_exact = std::abs(std::stod(power) - tolerance) <= 1e-9 * tolerance;
  return is_exact ? power : fmt::format("{:.1e}", tolerance);
}

std::string Setting::text() const {
  return is_tolerance() ? "tolerance " + value() : value() + " steps";
}

std::string Setting::option() const {
  return is_tolerance() ? fmt::format("--tolerance {}", tolerance) : fmt::format("--steps {}", steps);
}

}  // namespace ricochet
