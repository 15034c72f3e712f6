#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

/// Derivatives of the terminal state with respect to the control of each interval, by one method.
struct ControlGradient {
  static constexpr const char* kKind = "control_gradient";

  std::string problem, method;
  int steps = 0;                                 ///< per interval; 0 for the reference
  std::vector<std::string> components;           ///< of the terminal state
  std::vector<std::vector<double>> derivatives;  ///< per component, over intervals and controls
  double error = 0;                              ///< largest, relative to the reference's largest derivative
  double error_after_impact = 0;                 ///< the same, of the intervals after the last impact

  bool is_reference() const { return steps == 0; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlGradient, problem, method, steps, components, derivatives, error,
                                                error_after_impact)

/// One line per method and number of steps.
Table gradient_table(const std::vector<ControlGradient>& gradients);
/// Every derivative.
Table gradient_details(const std::vector<ControlGradient>& gradients);
/// Derivatives of each component of the terminal state over the intervals: the reference, and of every other method the
/// coarsest and the finest.
Chart gradient_chart(const std::vector<ControlGradient>& gradients, const std::string& name);

}  // namespace ricochet
