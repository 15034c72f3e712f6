#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/control/goals.h"
#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

/// An optimal control problem solved from one random initial guess.
struct SeedRun {
  static constexpr const char* kKind = "seed_run";

  std::string problem;
  std::string method = "homotopy";  ///< or "shooting"
  std::string linear_solver;        ///< of a homotopy's Newton systems: "mumps" or "ldl"; empty for shooting
  std::string arguments;  ///< of `ricochet control`, without the seed: what the runs of one group have in common
  unsigned seed = 0;
  std::string status, message;
  int iterations = 0;
  double seconds = 0;            ///< wall time, with that for the guess; NaN where times are not measured
  double cpu_seconds = 0;        ///< the same of the processor: other work on the machine disturbs it less
  double solve_cpu_seconds = 0;  ///< of these, without those for the guess

  // Results of a solved run.
  double cost = 0;
  std::string stationarity;      ///< "S", "M", "C", "W" or "unknown"; of shooting "B", "B up to an edge" or "not B"
  bool is_b_stationary = false;  ///< also up to an edge
  std::string replay_status;     ///< of adaptive FESD-J, under the controls found
  double terminal = 0;           ///< max-norm of claim minus replay in (q, v) at T; NaN when there is no replay

  bool succeeded() const { return status == "success"; }
  bool is_replayed() const { return replay_status == "success"; }
  /// Plan and plant end within 1e-9 of each other, in the units of q and v.
  bool is_replayed_exactly() const { return is_replayed() && terminal <= 1e-9; }
  bool is_certified() const { return succeeded() && is_b_stationary; }
  bool is_timed() const { return cpu_seconds > 0; }
  /// CPU time of an iteration of the solve [s]; NaN where there is none.
  double iteration_seconds() const;
  std::string command() const;  ///< reproduces the run
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(SeedRun, problem, method, linear_solver, arguments, seed, status,
                                                message, iterations, seconds, cpu_seconds, solve_cpu_seconds, cost,
                                                stationarity, is_b_stationary, replay_status, terminal)

/// The runs of one problem with one choice of arguments, in order of their first run.
using SeedGroup = std::vector<const SeedRun*>;
std::vector<SeedGroup> seed_groups(const std::vector<SeedRun>& runs);
/// Method and linear solver of one of these groups, for figures; with its arguments where another group of the problem has
/// the same.
std::string solver_name(const SeedGroup& group, const std::vector<SeedGroup>& groups);

/// One line per group: success, stationarity, spread of cost, CPU time and iterations.
Table seed_table(const std::vector<SeedRun>& runs);
/// Per problem, the first group of the homotopy and the first of shooting: successes, cost and time.
std::vector<Comparison> seed_comparisons(const std::vector<SeedRun>& runs);
/// Per problem, the first group of the homotopy with mumps and the first with ldl: guesses solved, CPU time per iteration.
std::vector<Comparison> linear_solver_comparisons(const std::vector<SeedRun>& runs);
/// One line per group and reason without a solution, with the seeds; the first sentence of the reason.
Table seed_failures(const std::vector<SeedRun>& runs);
/// Every run.
Table seed_details(const std::vector<SeedRun>& runs);
/// Cost over CPU time of every random guess, or over iterations where times are not measured, one panel per group. Those
/// without a solution are crosses on the upper frame.
Chart seed_chart(const std::vector<SeedRun>& runs, const std::string& name);

}  // namespace ricochet
