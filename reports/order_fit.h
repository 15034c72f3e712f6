#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reports/run.h"

namespace ricochet {

/// Observed order: the slope of log(error) over log(step length).
///
/// Window rule, the same for every method, fixed before any result was seen: of the runs in order of decreasing step
/// length, from the first after which every error is below 0.3 % of the solution (larger errors are not asymptotic) to
/// the last before any error is below 10 times the floor, the larger of the reference's uncertainty and 1e-13 of the
/// solution (rounding). Failed runs carry no error and are counted, not dropped in silence. Fewer than 6 points: no
/// fit. An interval wider than +- 1 does not tell an order from the next one: no fit.
struct OrderFit {
  double slope = 0;
  double half_width = 0;                ///< of the 95 % confidence interval of the slope (Student's t)
  double scatter = 0;                   ///< standard deviation of log10(error) around the line
  int first_steps = 0, last_steps = 0;  ///< window, as N_sim
  int used = 0, attempted = 0;

  double lower() const { return slope - half_width; }
  double upper() const { return slope + half_width; }
};

/// Observed order of a method: a fit, or the reason why there is none.
struct ObservedOrder {
  std::optional<OrderFit> fit;
  std::string no_fit;  ///< in a few words, "exact to rounding"; empty with a fit
  std::string reason;  ///< the same with numbers, as a sentence without its stop; empty with a fit
  double floor = 0;    ///< errors up to this are not fitted: 10 times the floor of the window rule; 0: no reference
};

/// Errors above this part of the solution are not asymptotic.
constexpr double kAsymptoticError = 3e-3;
/// Largest half width of the interval at which a fit counts.
constexpr double kWidestInterval = 1;

/// @param runs  of one fixed-step method, ascending steps (Results::of)
ObservedOrder observe_order(const std::vector<const Run*>& runs);
std::optional<OrderFit> fit_order(const std::vector<const Run*>& runs);

/// The line through the points as they are, whatever a window would leave out of them: slope, interval, scatter.
/// @param step_lengths, errors  > 0, at least three of them, not all of one step length
OrderFit fit_line(const std::vector<double>& step_lengths, const std::vector<double>& errors);

/// Slope between each run and the one before; empty where either has no error, or none that has a logarithm.
std::vector<std::optional<double>> local_slopes(const std::vector<const Run*>& runs);

}  // namespace ricochet
