#pragma once

#include <compare>
#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// The setting that distinguishes runs of one method: the number of steps of a fixed-step method, or the tolerance of an
/// error-controlled one. The other of the two is 0.
struct Setting {
  int steps = 0;         ///< N_sim
  double tolerance = 0;  ///< bound for the error of a step

  bool is_tolerance() const { return steps == 0; }
  /// "200", "1e-08" or "3.2e-08".
  std::string value() const;
  /// "200 steps" or "tolerance 1e-08".
  std::string text() const;
  /// The option of `ricochet run`, with all digits: "--steps 200" or "--tolerance 1e-08".
  std::string option() const;

  /// From coarse to fine: ascending steps, descending tolerances.
  std::partial_ordering operator<=>(const Setting& other) const {
    if (steps != other.steps) return steps <=> other.steps;
    return other.tolerance <=> tolerance;
  }
  bool operator==(const Setting& other) const = default;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Setting, steps, tolerance)

}  // namespace ricochet
