#include "bench/studies/grid/work_precision.h"

#include <algorithm>
#include <cmath>

#include "bench/studies/grid/curve_style.h"
#include "bench/studies/grid/grid_tables.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// Quantities that a reader can choose for an axis: field of a run, and title.
json measures(const GridResults& results) {
  return {{"errors",
           {{{"field", "error"}, {"label", results.error_measure().axis}},
            {{"field", "relative"}, {"label", "error over the size of the solution"}},
            {{"field", "position"}, {"label", "largest error of a coordinate at any time"}},
            {{"field", "velocity"}, {"label", "integral of the error of v over the time"}},
            {{"field", "end_velocity"}, {"label", "error of v at the end, away from impacts"}},
            {{"field", "event_time"}, {"label", "largest error of an event's time [s]"}},
            {{"field", "impulse"}, {"label", "largest error of a normal impulse [N s]"}},
            {{"field", "energy"}, {"label", "error of the energy at the end, away from jumps [J]"}},
            {{"field", "momentum"}, {"label", "error of the linear momentum at the end, away from jumps [N s]"}},
            {{"field", "penetration"}, {"label", "deepest penetration [m]"}},
            {{"field", "drift"}, {"label", "largest drift of a constraint [m]"}}}},
          {"works",
           {{{"field", "time"}, {"label", "CPU time [ms]"}},
            {{"field", "force_evaluations"}, {"label", "force evaluations"}},
            {{"field", "linear_solves"}, {"label", "linear solves"}},
            {{"field", "matrix_factorizations"}, {"label", "factorizations"}},
            {{"field", "steps"}, {"label", "steps"}},
            {{"field", "peak"}, {"label", "peak heap [kB]"}}}}};
}

/// Null for work that a method does not count: every one evaluates forces and solves with its mass matrix, engines and
/// some libraries do not say how often.
json counted(std::int64_t number, bool is_counted) {
  return is_counted ? json(number) : json();
}

/// Fields of a run that exist with or without a solution.
json work_of(const GridResults& results, const Run& record, std::size_t method) {
  const Counters& work = record.counters;
  return {{"method", method},
          {"setting", record.setting.text()},
          {"force_evaluations", counted(work.force_evaluations, work.force_evaluations > 0)},
          {"linear_solves", counted(work.linear_solves, work.linear_solves > 0)},
          {"matrix_factorizations",
           counted(work.matrix_factorizations, work.matrix_factorizations > 0 || work.linear_solves > 0)},
          {"steps", work.steps},
          {"events", record.detected_events},
          {"command", record.command()},
          {"row", row_id(results, record)}};
}

json run_of(const GridResults& results, const Run& record, std::size_t method) {
  const Timing& timing = *results.timing_of(record);
  const double size = record.solution_size > 0 ? record.solution_size : 1;
  json run = work_of(results, record, method);
  run.update({{"error", record.error},
              {"relative", record.error / size},
              {"position", record.metrics.position_error},  // null where the motion was not looked at
              {"velocity", record.metrics.velocity_error},
              {"end_velocity", record.metrics.end_velocity_error},
              {"event_time", record.metrics.event_time_error},
              {"impulse", record.metrics.impulse_error},
              {"energy", std::abs(record.metrics.energy_error)},
              {"momentum", record.metrics.momentum_error},
              {"penetration", record.metrics.penetration},
              {"drift", record.metrics.constraint_drift},
              {"time", 1e3 * timing.median},
              {"peak", results.peak_bytes_of(record) / 1e3},
              {"quartiles", {1e3 * timing.lower_quartile, 1e3 * timing.upper_quartile}}});
  return run;
}

/// With the run of another method that answers the failure, where the experiment has one.
json failure_of(const GridResults& results, const Run& record, std::size_t method) {
  json run = work_of(results, record, method);
  run.update({{"status", record.status}, {"reason", record.message}});
  if (const auto answer = replacement_of(results, record)) run["answer"] = "instead " + *answer;
  return run;
}

}  // namespace

Chart work_precision_chart(const GridResults& results) {
  Chart chart{
      .name = "work_precision",
      .file = results.id + "_work_precision",
      .title = "Work over error",
      .caption =
          "Every point is one run with a different step length or tolerance; down and left is better. Errors above 10 are drawn there. " +
          results.error_measure().definition +
          " Forces that a method reuses in the next step count once. Methods that do not count their work, such as engines, have no points.",
      .panels = {{.title = "",
                  .x = {.label = results.error_measure().axis, .is_log = true},
                  .y = {.label = "CPU time [ms]", .is_log = true}}},
      .width = 870,
      .height = 490};
  for (const auto& method : results.methods()) {
    Chart::Points points;
    for (const Run* run : results.of(method)) {
      if (const Timing* timing = results.timing_of(*run); run->has_error() && timing)
        points.emplace_back(std::clamp(run->error, kLeastDrawn, kLargestError), 1e3 * timing->median);
    }
    chart.panels.front().add(curve_label(results, *results.of(method).front()), curve_look(results, method),
                             Chart::Drawn::both, points);
  }
  return chart;
}

nlohmann::json work_precision_data(const GridResults& results) {
  json data = measures(results);
  if (!results.has_metrics()) data["errors"].erase(data["errors"].begin() + 2, data["errors"].end());
  data["largest_error"] = kLargestError;
  const auto looks = curve_looks(results);
  data["methods"] = data["runs"] = data["failures"] = json::array();
  for (const auto& method : results.methods()) {
    const auto runs = results.of(method);
    const std::size_t index = data["methods"].size();
    data["methods"].push_back({{"id", method},
                               {"label", curve_label(results, *runs.front())},
                               {"family", family_title(curve_family(method))},
                               {"colour", looks[index].colour},
                               {"symbol", looks[index].symbol},
                               {"dash", looks[index].dash}});
    for (const Run* run : runs) {
      if (run->has_error() && results.timing_of(*run)) data["runs"].push_back(run_of(results, *run, index));
      if (!run->succeeded() && run->status != "not_built") data["failures"].push_back(failure_of(results, *run, index));
    }
  }
  return data;
}

}  // namespace ricochet
