#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reports/record.h"

namespace ricochet {

/// Observed order: the slope of log(error) over log(step length).
///
/// Window rule, the same for every method, fixed before any result was seen: of the runs in order of decreasing step
/// length, from the first behind which every error is below 0.3 % of the solution (larger errors are not asymptotic) to
/// the last before any error is below 10 times the floor, the larger of the reference's uncertainty and 1e-13 of the
/// solution (rounding). Failed runs carry no error and are counted, not dropped in silence. Fewer than 6 points: no
/// fit.
struct OrderFit {
  double slope = 0;
  double half_width = 0;                ///< of the 95 % confidence interval of the slope (Student's t)
  double scatter = 0;                   ///< standard deviation of log10(error) around the line
  int first_steps = 0, last_steps = 0;  ///< window, as N_sim
  int used = 0, attempted = 0;

  double lower() const { return slope - half_width; }
  double upper() const { return slope + half_width; }
};

/// Errors above this part of the solution are not asymptotic.
constexpr double kAsymptoticError = 3e-3;

/// @param runs  of one fixed-step method, ascending steps (Results::of)
std::optional<OrderFit> fit_order(const std::vector<const Record*>& runs);

/// Slope between each run and the one before; empty where either has no error.
std::vector<std::optional<double>> local_slopes(const std::vector<const Record*>& runs);

}  // namespace ricochet
