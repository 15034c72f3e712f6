#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/solution.h"
#include "reports/metrics.h"

namespace ricochet {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Counters, steps, elements, force_evaluations, jacobian_evaluations,
                                                mass_factorizations, matrix_factorizations, linear_solves,
                                                complementarity_solves, inner_iterations, pivots, events)

/// One run of one method with one setting: what an order is fitted to.
struct Record {
  static constexpr const char* kKind = "row";

  std::string experiment, problem;
  std::string method;  ///< as on the command line
  std::string title;
  int steps = 0;         ///< N_sim, fixed-step methods
  double tolerance = 0;  ///< error-controlled methods
  double h_bar = 0;      ///< mean length of a Runge-Kutta step, T / elements [s]
  double nominal_order = 0;
  std::string status;  ///< to_string(Status)
  std::string message;
  double error = 0;            ///< max-norm of the error of the final (q, v); NaN when the run failed
  double reference_error = 0;  ///< bound for the error of the reference
  double solution_size = 0;    ///< max-norm of the reference's final (q, v)
  /// Where there are some, `error` is that of d(q, v) with respect to these (reference::sensitivity_difference), and
  /// `solution_size` is 1.
  std::vector<std::string> sensitivities;
  double max_residual = -1;  ///< -1: not audited
  int detected_events = 0;
  Counters counters;
  Metrics metrics;
  std::string instead_of;  ///< method whose failure at this setting this run answers; empty otherwise
  std::string expected;    ///< why the experiment expects that it may fail; empty: a failure is a surprise
  std::string command;     ///< reproduces the run

  bool succeeded() const { return status == "success"; }
  bool has_error() const;  ///< succeeded, and was compared with a reference
  /// "200" or "1e-08": the setting that distinguishes runs of one method.
  std::string setting() const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Record, experiment, problem, method, title, steps, tolerance, h_bar,
                                                nominal_order, status, message, error, reference_error, solution_size,
                                                sensitivities, max_residual, detected_events, counters, metrics,
                                                instead_of, expected, command)

/// Of one method and without replacements: ascending steps, descending tolerances.
std::vector<const Record*> runs_of(const std::vector<Record>& records, const std::string& method);

}  // namespace ricochet
