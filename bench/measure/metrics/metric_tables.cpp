#include "bench/measure/metrics/metric_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/measure/metrics/metrics.h"
#include "reports/table.h"

namespace ricochet {
namespace {

using M = MeasuredRun;

auto metric(auto member) {
  return [=](const M& run) { return run.metrics.*member; };
}

/// Nothing without a reference motion, which every run with one has a distance from.
auto events(int Metrics::*member) {
  return [=](const M& run) { return when(!std::isnan(run.metrics.position_error), run.metrics.*member); };
}

/// Columns that identify the run, then `quantities`.
std::vector<Column<M>> columns_of(const std::vector<M>& runs, std::vector<Column<M>> quantities) {
  std::vector<Column<M>> columns;
  if (!std::ranges::all_of(runs, &std::string::empty, &M::scene)) columns.emplace_back("scene", &M::scene);
  columns.emplace_back("method", &M::method);
  columns.emplace_back("setting", "", "{}", &M::setting);
  std::ranges::move(quantities, std::back_inserter(columns));
  return columns;
}

Table motion_table(const std::vector<M>& runs) {
  const auto columns = columns_of(
      runs,
      {
          {"position, largest", "", "{:.2e}", metric(&Metrics::position_error)},
          {"velocity, integral", "", "{:.2e}", metric(&Metrics::velocity_error)},
          {"velocity at the end", "", "{:.2e}", metric(&Metrics::end_velocity_error)},
          {"event times", "s", "{:.2e}", metric(&Metrics::event_time_error)},
          {"missed", "", "{}", events(&Metrics::missed_events)},
          {"spurious", "", "{}", events(&Metrics::spurious_events)},
          {"impulses", "N s", "{:.2e}", metric(&Metrics::impulse_error)},
          {"energy", "J", "{:+.2e}", metric(&Metrics::energy_error)},
          {"linear momentum", "N s", "{:.2e}", metric(&Metrics::momentum_error)},
          {"angular momentum", "N m s", "{:.2e}", metric(&Metrics::angular_momentum_error)},
          {"digits of the reference", "", "{:.1f}",
           [](const M& m) { return when(m.reference_error > 0, std::log10(m.solution_size / m.reference_error)); }},
      });
  return table_of(
      "Errors of the motion", columns, runs,
      "Against an event-located motion: the largest error of a coordinate at any time, the integral of that "
      "of v over the time, which an impact that is late by dt hurts by dt and not by its jump; velocity, "
      "energy (with its sign) and momentum of the bodies about the origin at the end, none with an impact in "
      "the last hundredth of the time. Events are those of one contact and kind that are nearest to each "
      "other seen from both sides; the rest is missed, or spurious.");
}

Table impact_table(const std::vector<M>& runs) {
  const auto columns = columns_of(runs, {
                                            {"penetration", "m", "{:.2e}", metric(&Metrics::penetration)},
                                            {"constraint drift", "m", "{:.2e}", metric(&Metrics::constraint_drift)},
                                            {"Signorini", "m", "{:.2e}", metric(&Metrics::signorini)},
                                            {"restitution", "m/s", "{:.2e}", metric(&Metrics::restitution)},
                                            {"Coulomb cone", "m/s", "{:.2e}", metric(&Metrics::cone)},
                                            {"maximum dissipation", "m/s", "{:.2e}", metric(&Metrics::dissipation)},
                                        });
  return table_of(
      "Residuals by law, impacts", columns, runs,
      "Largest over the motion, and over the impacts that the method tells: Signorini, the gap at which an "
      "impulse acts; restitution, |min(v_n+ + e v_n-, W Lambda_n)| with the diagonal entry W of the Delassus operator, under Newton's hypothesis; "
      "Coulomb cone, W max(0, |Lambda_t| - mu Lambda_n); maximum dissipation, |v_t| + Lambda_t' v_t / (mu Lambda_n). "
      "'-' where no impact, friction or constraint is.");
}

Table contact_table(const std::vector<M>& runs) {
  const auto columns =
      columns_of(runs, {
                           {"Signorini", "m", "{:.2e}", metric(&Metrics::contact_gap)},
                           {"pull", "m/s", "{:.2e}", metric(&Metrics::contact_pull)},
                           {"Coulomb cone", "m/s", "{:.2e}", metric(&Metrics::contact_cone)},
                           {"maximum dissipation", "J", "{:.2e}", metric(&Metrics::contact_dissipation)},
                       });
  return table_of(
      "Residuals by law, persistent contact", columns, runs,
      "Where the reference motion has a closed contact, with the forces lambda that the motion needs, as the method "
      "interpolates it between its steps (least squares of the equations of motion): Signorini, the largest gap; integrals over the time of W max(0, -lambda_n), of "
      "W max(0, |lambda_t| - mu lambda_n) and of |mu lambda_n |v_t| + lambda_t' v_t|. '-' without friction, and where "
      "contacts are redundant at some time, so that the motion does not determine forces.");
}

/// Reasons why runs have no metrics, or none against a reference motion, and the number of these runs.
std::string reasons(const std::vector<M>& runs) {
  std::map<std::pair<bool, std::string>, int> counts;
  for (const M& run : runs) {
    const std::string& why = run.metrics.reason;
    if (!run.metrics.are_known || !why.empty())
      ++counts[{run.metrics.are_known, why.empty() ? "the results do not say why" : why}];
  }
  std::string text;
  for (const auto& [reason, n] : counts)
    text +=
        fmt::format(" {}: {} ({}).", reason.first ? "Without a reference motion" : "Not looked at", n, reason.second);
  return text;
}

}  // namespace

void show_metrics(const std::vector<MeasuredRun>& all, Section& section) {
  const auto runs = rows_where(all, [](const M& run) { return run.metrics.are_known; });
  if (runs.empty()) return;
  Table motions = motion_table(runs);
  motions.note += reasons(all);
  section.details("motions", motions);
  section.details("laws", impact_table(runs));
  const auto persistent = rows_where(runs, [](const M& run) { return !std::isnan(run.metrics.contact_gap); });
  if (!persistent.empty()) section.details("contacts", contact_table(persistent));
}

}  // namespace ricochet
