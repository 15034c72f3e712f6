#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>

#include "bench/studies/control/mpc_rows.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

using Updates = std::vector<MpcRun::Update>;

double median_seconds(const Updates& updates) {
  std::vector<double> seconds;
  for (const auto& update : updates) seconds.push_back(update.seconds);
  return seconds.empty() ? std::numeric_limits<double>::quiet_NaN() : median(seconds);
}

Updates without_plan(const MpcRun& run) {
  return rows_where(run.updates, [](const MpcRun::Update& update) { return !update.has_plan; });
}

/// Updates on the branch of the plan, or those that ended in a stationary point.
Updates kept_updates(const MpcRun& run) {
  return rows_where(run.updates, [&](const MpcRun::Update& update) {
    return run.method == kHomotopy ? update.kept_branch : update.status == "success";
  });
}

}  // namespace

Table mpc_table(const std::vector<MpcRun>& runs) {
  using R = MpcRun;
  static const std::vector<Column<R>> columns = {
      {"problem", &R::problem},
      {"method", &R::method},
      {"disturbance", "", "{:g}", &R::disturbance},
      {"first", &R::status},
      {"first", "s", "{:.3g}", &R::seconds},
      {"updates", "", "{}", [](const R& r) { return r.updates.size(); }},
      {"branch or stationary", "", "{}", [](const R& r) { return kept_updates(r).size(); }},
      {"without a plan", "", "{}", [](const R& r) { return without_plan(r).size(); }},
      {"update, median", "s", "{:.3g}", [](const R& r) { return median_seconds(r.updates); }},
      {"longest", "s", "{:.3g}",
       [](const R& r) {
         return r.updates.empty() ? std::numeric_limits<double>::quiet_NaN()
                                  : std::ranges::max(r.updates | std::views::transform(&R::Update::seconds));
       }},
      {"planned cost", "", "{:.6g}", [](const R& r) { return when(!r.updates.empty(), r.planned_cost); }},
      {"cost", "", "{:.6g}", [](const R& r) { return when(r.has_arrived(), r.cost); }},
  };
  return without_empty(
      table_of("Model predictive control", columns, runs,
               "Before every update the plant is moved at random by up to the disturbance, in m or rad; velocities by "
               "that part of themselves. Branch: the homotopy solved the branch of the plan and did not begin again; "
               "stationary: shooting ended before its limits. An update without a plan leaves the last one in force. "
               "Cost: of the plant at T."),
      {"first [s]", "update, median [s]", "longest [s]"});
}

Table mpc_updates(const std::vector<MpcRun>& runs) {
  struct Line {
    const MpcRun* run;
    MpcRun::Update update;
  };
  static const std::vector<Column<Line>> columns = {
      {"problem", [](const Line& l) { return l.run->problem; }},
      {"method", [](const Line& l) { return l.run->method; }},
      {"disturbance", "", "{:g}", [](const Line& l) { return l.run->disturbance; }},
      {"t", "s", "{:.4g}", [](const Line& l) { return l.update.t; }},
      {"status", [](const Line& l) { return l.update.status; }},
      {"plan", [](const Line& l) { return l.update.has_plan ? (l.update.kept_branch ? "branch" : "new") : "old"; }},
      {"iterations", "", "{}", [](const Line& l) { return l.update.iterations; }},
      {"seconds", "", "{:.3g}", [](const Line& l) { return l.update.seconds; }},
      {"violation", "", "{:.1e}", [](const Line& l) { return l.update.violation; }},
      {"reason", [](const Line& l) { return l.update.message; }},
  };
  std::vector<Line> lines;
  for (const auto& run : runs) {
    for (const auto& update : run.updates) lines.push_back({&run, update});
  }
  return without_empty(table_of("Updates", columns, lines), {"seconds"});
}

std::vector<Comparison> mpc_comparisons(const std::vector<MpcRun>& runs) {
  std::vector<Comparison> comparisons;
  for (const auto& shooting : runs) {
    const auto homotopy = std::ranges::find_if(runs, [&](const MpcRun& r) {
      return r.problem == shooting.problem && r.method == kHomotopy && r.disturbance == shooting.disturbance;
    });
    if (shooting.method != kShooting || homotopy == runs.end()) continue;
    const std::string at = fmt::format(" at {:g}", shooting.disturbance);
    if (shooting.seconds > 0)
      comparisons.push_back(quotient(shooting.problem, "median update" + at, median_seconds(kept_updates(*homotopy)),
                                     median_seconds(shooting.updates)));
    const auto count = [](const MpcRun& run) {
      return fmt::format("{} of {}", without_plan(run).size(), run.updates.size());
    };
    comparisons.push_back({shooting.problem, "without a plan" + at, count(*homotopy), count(shooting),
                           static_cast<double>(without_plan(shooting).size())});
    if (homotopy->has_arrived() && shooting.has_arrived())
      comparisons.push_back(quotient(shooting.problem, "cost" + at, homotopy->cost, shooting.cost));
  }
  return comparisons;
}

Chart mpc_chart(const std::vector<MpcRun>& runs, const std::string& file) {
  Chart chart{.name = "updates",
              .file = file,
              .title = "Time of an update",
              .caption = "Wall time of planning again over the time of the task. Crosses: updates without a plan.",
              .columns = 2};
  for (const auto& run : runs) {
    Chart::Panel& panel = chart.panel(fmt::format("{}, moved by {:g}", run.problem, run.disturbance),
                                      {.label = "t [s]", .from = 0}, {.label = "seconds", .is_log = true});
    Chart::Points planned, failed;
    for (const auto& update : run.updates) (update.has_plan ? planned : failed).emplace_back(update.t, update.seconds);
    const auto look = CurveLook::of(run.method == kHomotopy ? 0 : 1);
    panel.add(run.method, look, Chart::Drawn::both, planned);
    if (!failed.empty()) panel.add(run.method + ", no plan", {.colour = 7}, Chart::Drawn::failed, failed);
  }
  return chart;
}

}  // namespace ricochet
