#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "methods/fesd_homotopy/step_homotopy.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/problem.h"

namespace ricochet {

/// A run of the pivoting solver with what a homotopy needs to begin anywhere in it.
struct PivotingRun {
  ButcherTableau tableau;
  int steps = 0;  ///< N_sim
  Status status = Status::success;
  std::string message;               ///< why it ended early
  std::vector<Vector> q, v;          ///< at the ends of the steps that were solved; the initial state first
  std::vector<bool> has_impact;      ///< of each step that was solved
  std::vector<double> milliseconds;  ///< CPU time of each of them
};

PivotingRun run_pivoting(const Problem& problem, const ButcherTableau& tableau, int steps);

/// Results of a homotopy on some steps of a run.
struct HomotopyRun {
  int steps = 0, failed = 0, retried = 0;
  std::vector<double> milliseconds[2];  ///< CPU time of the steps that were solved; [1]: with an impact
  std::vector<double> distances;        ///< to the pivoting solver, (q, v) at the end of every stretch of steps
  std::vector<std::string> failures;    ///< what and why
  bool is_complete = false;             ///< all N_sim steps were solved, one after the other
  Vector q, v;                          ///< at the end
  bool solves_infeasible = false;       ///< the step that the pivoting solver found none for
};

/// Solves the steps of a run that are within `margin` of one with an impact; margin < 0: all steps. Every stretch of
/// them begins from the state of the pivoting solver, and so does the step after one that failed.
HomotopyRun run_homotopy(const Problem& problem, const PivotingRun& pivoting, const StepHomotopy::Options& options,
                         int margin);

}  // namespace ricochet
