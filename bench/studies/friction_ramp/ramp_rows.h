#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

/// One method with one setting on all ramps of a grid: mu by rows, tan(slope) by columns, both `values`; or on some rows
/// of it, as they are made.
struct RampGrid {
  static constexpr const char* kKind = "ramp_grid";
  enum Cell { right, moves_but_should_rest, rests_but_should_move, failed, declined };

  std::string method, setting;  ///< "-N 20" or "--tolerance 1e-08"
  double v_0 = 0;               ///< initial speed down the ramp [m/s]
  std::vector<double> values;
  int first_row = 0;                       ///< of `values`, of those that `error` and `cells` have
  std::vector<std::vector<double>> error;  ///< of the position at the end [m]; NaN where the run failed
  std::vector<std::vector<int>> cells;     ///< Cell
  double seconds = 0;                      ///< of all runs together; NaN where it is not measured
  std::string message;                     ///< of the first run that failed, or why the method declines

  int count(Cell cell) const;
  int wrong() const { return count(moves_but_should_rest) + count(rests_but_should_move); }
  /// Number of wrong cells with tan(slope) = mu, where rounding decides.
  int wrong_on_boundary() const;
  double largest_error() const;              ///< of the runs that succeeded
  double largest_error_on_boundary() const;  ///< the same, where tan(slope) = mu
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(RampGrid, method, setting, v_0, values, first_row, error, cells,
                                                seconds, message)

/// A block at rest on a ramp in space, over the direction of the way down, by one method.
struct RampFacets {
  static constexpr const char* kKind = "ramp_facets";

  std::string method;
  int facets = 0;                          ///< 0: the disc
  double load = 0;                         ///< tan(slope) / mu of `drift`
  std::vector<double> direction;           ///< [rad]
  std::vector<double> limit, limit_exact;  ///< largest tan(slope) / mu at which it sticks
  std::vector<double> drift, drift_exact;  ///< angle from the way down to the displacement at the end [rad]
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(RampFacets, method, facets, load, direction, limit, limit_exact, drift,
                                                drift_exact)

/// The complete grids, in the order of their first parts; an interrupted run leaves incomplete ones.
/// @throws InputError for rows that follow none
std::vector<RampGrid> whole_grids(const std::vector<RampGrid>& parts);

/// One line per method and initial speed.
Table ramp_table(const std::vector<RampGrid>& grids);
/// One line per method: what a polygon in place of the disc does, and how far the method is from its exact solution.
Table ramp_facets_table(const std::vector<RampFacets>& facets);

/// Errors on the (tan(slope), mu) plane, a panel per method, for the last initial speed of the results.
Chart ramp_chart(const std::vector<RampGrid>& grids, const std::string& name);

/// Effects of friction polygons: stick limit and direction of slip over the downhill direction.
Chart ramp_facets_chart(const std::vector<RampFacets>& facets, const std::string& name);

}  // namespace ricochet
