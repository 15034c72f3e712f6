#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/table.h"

namespace ricochet {

/// The steps of one FESD-J run as one solver of its equations finds them.
struct HomotopyRow {
  static constexpr const char* kKind = "homotopy_run";

  std::string family;  ///< of the tableau
  std::string solver;  ///< "pivoting", or the options of the homotopy: "guess=cold"
  int stages = 0;
  int run_steps = 0;  ///< N_sim
  int steps = 0, failed = 0, retried = 0;
  std::vector<double> free_milliseconds,
      impact_milliseconds;            ///< CPU time of the steps that were solved; empty where it is not measured
  std::vector<double> distances;      ///< to the pivoting solver, (q, v) at the end of every stretch of steps
  std::vector<std::string> failures;  ///< what and why
  bool solves_infeasible = false;     ///< the step that the pivoting solver found none for
  double error = 0;                   ///< of the final state; NaN unless all steps were solved one after the other
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(HomotopyRow, family, solver, stages, run_steps, steps, failed, retried,
                                                free_milliseconds, impact_milliseconds, distances, failures,
                                                solves_infeasible, error)

/// One line per family and solver.
Table homotopy_table(const std::vector<HomotopyRow>& rows);
/// Every step that was not solved, and those that only the homotopy solves.
Table homotopy_failures(const std::vector<HomotopyRow>& rows);

}  // namespace ricochet
