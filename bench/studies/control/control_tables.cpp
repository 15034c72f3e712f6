#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/studies/control/control_views.h"

namespace ricochet {
namespace {

std::string impact_times_off(const ControlRun& run) {
  if (!run.is_replayed()) return "-";
  return std::isnan(run.events) ? "other" : scientific(run.events);
}

std::string failure_reason(const ControlRun& run) {
  return run.succeeded() ? "replay: " + run.replay_message : fmt::format("{}: {}", run.status, run.message);
}

}  // namespace

Table control_table(const std::vector<ControlRun>& runs) {
  using R = ControlRun;
  static const std::vector<Column<R>> columns = {
      {"problem", &R::problem},
      {"method", &R::method},
      {"discretisation", &R::discretisation},
      {"variables", "", "{}", &R::variables},
      {"iterations", "", "{}", &R::iterations},
      {"seconds", "", "{:.2f}", &R::seconds},
      {"status", &R::status},
      {"claimed cost", "", "{:.6g}", [](const R& r) { return when(r.succeeded(), r.claimed_cost); }},
      {"true cost", "", "{:.6g}", [](const R& r) { return when(r.is_replayed(), r.true_cost); }},
      {"terminal", "", "{:.1e}", [](const R& r) { return when(r.is_replayed(), r.terminal); }},
      {"impacts", "s", "{}", impact_times_off},
      {"stationary", [](const R& r) { return r.stationarity.empty() ? "-" : r.stationarity; }},
      {"penetration", "", "{:.1e}", [](const R& r) { return when(r.succeeded(), r.penetration); }},
      {"replayed by", [](const R& r) { return r.is_replayed() ? r.replayed_by : "-"; }},
  };
  return without_empty(
      table_of(
          "Claimed and true optimal control", columns, runs,
          "True: the controls applied in open loop to the plant, with the event-located reference, or with adaptive "
          "FESD-J if the reference finds the forces indeterminate. Terminal: max-norm of the difference of (q, v) at "
          "T. Impacts: largest difference of their times, \"other\" for different impacts. Penetration: deepest in the "
          "claimed motion. Seconds include the initial guess."),
      {"seconds", "stationary"});
}

Table control_failures(const std::vector<ControlRun>& runs) {
  using R = ControlRun;
  static const std::vector<Column<R>> columns = {
      {"problem", &R::problem},   {"method", &R::method},   {"discretisation", &R::discretisation},
      {"reason", failure_reason}, {"command", &R::command},
  };
  const auto failed = rows_where(runs, [](const R& run) { return !run.succeeded() || !run.replay_message.empty(); });
  return table_of("Not solved, or not replayed by the reference", columns, failed);
}

}  // namespace ricochet
