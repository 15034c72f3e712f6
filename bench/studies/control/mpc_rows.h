#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/control/goals.h"
#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

/// Model predictive control of one problem by one method: the plant runs a plan, is moved before every update, and the
/// rest is planned again.
struct MpcRun {
  static constexpr const char* kKind = "mpc_run";

  /// One solve of the rest.
  struct Update {
    double t = 0;  ///< of the plant [s]
    std::string status = {}, message = {};
    bool has_plan = false;     ///< a new one; otherwise the rest of the last one stays in force
    bool kept_branch = false;  ///< of a homotopy
    int iterations = 0;
    double seconds = 0;
    double violation = 0;
  };

  std::string problem, method;
  std::string command;  ///< reproduces the run
  double disturbance = 0;
  std::string status, message;  ///< of the first solve, or of the plant where it cannot go on
  double seconds = 0;           ///< of the first solve
  double planned_cost = 0;      ///< in the first plan
  double cost = 0;              ///< of the plant, at T
  std::vector<Update> updates;

  bool has_arrived() const { return cost > 0; }
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(MpcRun::Update, t, status, message, has_plan, kept_branch, iterations,
                                                seconds, violation)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(MpcRun, problem, method, command, disturbance, status, message, seconds,
                                                planned_cost, cost, updates)

/// One line per run.
Table mpc_table(const std::vector<MpcRun>& runs);
/// One line per update.
Table mpc_updates(const std::vector<MpcRun>& runs);
/// Per problem and disturbance: median time of a second solve, of the homotopy that of those on a branch; updates without
/// a plan; cost.
std::vector<Comparison> mpc_comparisons(const std::vector<MpcRun>& runs);
/// Seconds of the updates over time, a panel per problem and disturbance.
Chart mpc_chart(const std::vector<MpcRun>& runs, const std::string& file);

}  // namespace ricochet
