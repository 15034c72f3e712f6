#include "bench/studies/grid/grid_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reports/order_fit.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

/// A record with what is known of it beside its own numbers.
struct GridLine {
  const Run* run;
  std::optional<Timing> timing;
  std::optional<double> slope;  ///< to the run before
  std::string answer;           ///< of a run that failed: what was run instead

  GridLine(const GridResults& results, const Run& record) : run(&record) {
    if (const Timing* known = results.timing_of(record)) timing = *known;
  }

  std::optional<double> microseconds_per_step() const {
    if (!timing || run->counters.steps == 0) return std::nullopt;
    return timing->median * 1e6 / static_cast<double>(run->counters.steps);
  }
  std::optional<double> residual() const { return when(run->max_residual >= 0, run->max_residual); }
};

/// Getter of a column, applied to the run.
auto of_run(auto value) {
  return [=](const GridLine& line) { return std::invoke(value, *line.run); };
}
auto counter(auto member) {
  return [=](const GridLine& line) { return line.run->counters.*member; };
}
/// In milliseconds.
auto time_of(double Timing::*part) {
  return [=](const GridLine& line) -> std::optional<double> {
    return line.timing ? std::optional(1e3 * (*line.timing).*part) : std::nullopt;
  };
}

/// A method with fixed steps: its order, and its runs together.
struct OrderLine {
  std::string method;
  double nominal = 0;
  ObservedOrder order;
  double microseconds_per_step = 0;
  double residual = -1;  ///< the largest; -1: not audited
  int solved = 0;
  std::size_t runs = 0;
};

OrderLine order_line(const GridResults& results, const std::string& method) {
  const auto runs = results.of(method);
  OrderLine line{method, runs.front()->nominal_order, observe_order(runs)};
  std::vector<double> times;
  for (const Run* run : runs) {
    line.solved += run->succeeded();
    line.residual = std::fmax(line.residual, run->max_residual);
    if (const auto time = GridLine(results, *run).microseconds_per_step()) times.push_back(*time);
  }
  line.microseconds_per_step = median(times);
  line.runs = runs.size();
  return line;
}

/// A cell that says something of a fit, "-" where there is none.
auto of_fit(auto value) {
  return [=](const OrderLine& line) { return line.order.fit ? std::optional(value(*line.order.fit)) : std::nullopt; };
}

}  // namespace

std::optional<std::string> replacement_of(const GridResults& results, const Run& record) {
  std::optional<std::string> answer;
  for (const auto& other : results.records) {
    if (other.instead_of != record.method || other.setting != record.setting) continue;
    answer = other.succeeded() ? fmt::format("{}: error {:.2e}", other.method, other.error)
                               : fmt::format("{}: {}", other.method, other.status);
  }
  return answer;
}

std::string row_id(const GridResults& results, const Run& record) {
  return fmt::format("{}-line-{}", results.id, results.line_of(record));
}

Table order_summary(const GridResults& results) {
  using L = OrderLine;
  static const std::vector<Column<L>> columns = {
      {"method", &L::method},
      {"nominal", "", "{:g}", &L::nominal},
      {"fitted slope", "", "{}",
       [](const L& l) { return l.order.fit ? fmt::format("{:.2f}", l.order.fit->slope) : "not asymptotic"; }},
      {"95 % interval", "", "{}",
       of_fit([](const OrderFit& f) { return fmt::format("{:.2f} .. {:.2f}", f.lower(), f.upper()); })},
      {"scatter", "", "{:.2f}", of_fit([](const OrderFit& f) { return f.scatter; })},
      {"window N_sim", "", "{}",
       of_fit([](const OrderFit& f) { return fmt::format("{} .. {}", f.first_steps, f.last_steps); })},
      {"points", "", "{}",
       [](const L& l) {
         return l.order.fit ? fmt::format("{}/{}", l.order.fit->used, l.runs) : fmt::format("-/{}", l.runs);
       }},
      {"floor", "", "{:.1e}", [](const L& l) { return when(l.order.floor > 0, l.order.floor); }},
      {"us/step", "", "{:.3f}", &L::microseconds_per_step},
      {"largest residual", "", "{:.2e}", [](const L& l) { return when(l.residual >= 0, l.residual); }},
      {"solved", "", "{}", [](const L& l) { return fmt::format("{}/{}", l.solved, l.runs); }},
      {"why no order", [](const L& l) { return l.order.fit ? "" : l.order.no_fit + ": " + l.order.reason; }},
  };
  std::vector<OrderLine> lines;
  for (const auto& method : results.methods()) {
    const bool is_error_controlled =
        results.of(method).front()->setting.is_tolerance();  // no step length to fit against
    if (!is_error_controlled) lines.push_back(order_line(results, method));
  }
  return table_of(
      "Observed orders", columns, lines,
      "Slope of log10(error) over log10(step length); the window follows one rule for all methods "
      "(reports/order_fit.h). The interval measures how well the points fit a line; scatter is in decades. Errors "
      "below a floor of 10 times the uncertainty of the reference, or of rounding, are not fitted. "
      "us/step: median over the grid. " +
          results.error_measure().definition);
}

Table order_details(const GridResults& results) {
  using L = GridLine;
  static const std::vector<Column<L>> columns = {
      {"method", of_run(&Run::method)},
      {"N_sim", "", "{}", [](const L& l) { return l.run->setting.value(); }},
      {"h_bar", "", "{:.2e}", of_run(&Run::h_bar)},
      {"error", "", "{:.2e}", of_run(&Run::error)},
      {"local slope", "", "{:.2f}", &L::slope},
      {"us/step", "", "{:.3f}", &L::microseconds_per_step},
      {"elements", "", "{}", counter(&Counters::elements)},
      {"force evals", "", "{}", counter(&Counters::force_evaluations)},
      {"Newton its", "", "{}", counter(&Counters::inner_iterations)},
      {"factorizations", "", "{}", counter(&Counters::matrix_factorizations)},
      {"LCPs", "", "{}", counter(&Counters::complementarity_solves)},
      {"events", "", "{}", of_run(&Run::detected_events)},
      {"largest residual", "", "{:.2e}", &L::residual},
      {"status", of_run(&Run::status)},
      {"reason", of_run(&Run::message)},
  };
  std::vector<GridLine> lines;
  for (const auto& method : results.methods()) {
    const auto runs = results.of(method);
    const auto slopes = local_slopes(runs);
    for (std::size_t k = 0; k < runs.size(); ++k) {
      lines.emplace_back(results, *runs[k]).slope = slopes[k];
      for (const auto& other : results.records) {
        if (other.instead_of == method && other.setting == runs[k]->setting) lines.emplace_back(results, other);
      }
    }
  }
  return table_of("All runs", columns, lines,
                  "Runs above 20000 steps are not audited (residual '-'). " + results.error_measure().definition);
}

std::vector<MeasuredRun> measured_runs(const GridResults& results) {
  std::vector<MeasuredRun> runs;
  for (const auto& method : results.methods()) {
    for (const Run* run : results.of(method)) {
      if (run->succeeded())
        runs.push_back({"", method, run->setting.value(), run->metrics, run->reference_error, run->solution_size});
    }
  }
  return runs;
}

Table failures(const GridResults& results) {
  using L = GridLine;
  static const std::vector<Column<L>> columns = {
      {"method", of_run(&Run::method)},
      {"setting", [](const L& l) { return l.run->setting.value(); }},
      {"status", of_run(&Run::status)},
      {"reason", of_run(&Run::message)},
      {"expected", [](const L& l) { return l.run->expected.empty() ? "no" : l.run->expected; }},
      {"answered by", &L::answer},
      {"command", [](const L& l) { return l.run->command(); }},
  };
  std::vector<GridLine> lines;
  for (const auto& record : results.records) {
    if (record.succeeded() || !record.instead_of.empty()) continue;
    lines.emplace_back(results, record).answer = replacement_of(results, record).value_or("-");
  }
  const auto attempted =
      std::count_if(results.records.begin(), results.records.end(), [](const Run& r) { return r.instead_of.empty(); });
  const auto answers = static_cast<std::ptrdiff_t>(results.records.size()) - attempted;
  std::string note = fmt::format("{} of {} runs.", lines.size(), attempted);
  if (answers > 0) note += fmt::format(" {} more were run to answer them.", answers);
  return table_of("Runs without a solution", columns, lines, note);
}

Table time_to_reach(const GridResults& results, const std::vector<double>& levels) {
  struct Line {
    std::string method;
    std::vector<double> times;  ///< [ms], shortest per level; infinite where it is not reached
  };
  std::vector<Line> lines;
  std::vector<double> fastest(levels.size(), std::numeric_limits<double>::infinity());
  for (const auto& method : results.methods()) {
    Line line{method, {}};
    for (std::size_t k = 0; k < levels.size(); ++k) {
      double best = std::numeric_limits<double>::infinity();
      for (const Run* run : results.of(method)) {
        const Timing* timing = results.timing_of(*run);
        if (run->has_error() && timing && run->error <= levels[k]) best = std::min(best, 1e3 * timing->median);
      }
      line.times.push_back(best);
      fastest[k] = std::min(fastest[k], best);
    }
    lines.push_back(std::move(line));
  }
  std::vector<Column<Line>> columns = {{"method", &Line::method}};
  for (std::size_t k = 0; k < levels.size(); ++k) {
    columns.push_back({fmt::format("ms to {:.0e}", levels[k]), "", "{}", [k](const Line& l) {
                         return std::isfinite(l.times[k]) ? fmt::format("{:.3f}", l.times[k]) : "not reached";
                       }});
    columns.push_back({"x fastest", "", "{:.1f}", [k, best = fastest[k]](const Line& l) {
                         return when(std::isfinite(l.times[k]), l.times[k] / best);
                       }});
  }
  return table_of("Time to reach an error", columns, lines,
                  "Shortest median CPU time of a run whose error is at most the level; nothing is interpolated. " +
                      results.error_measure().definition);
}

Table overhead(const GridResults& results) {
  struct Line {
    std::string method, compared;
    std::int64_t elements;
    double seconds, compared_seconds;

    double nanoseconds(double time) const { return time * 1e9 / static_cast<double>(elements); }
  };
  using L = Line;
  static const std::vector<Column<L>> columns = {
      {"method", &L::method},
      {"compared with", &L::compared},
      {"elements", "", "{}", &L::elements},
      {"ns/element", "", "{:.1f}", [](const L& l) { return l.nanoseconds(l.seconds); }},
      {"ns/element compared", "", "{:.1f}", [](const L& l) { return l.nanoseconds(l.compared_seconds); }},
      {"ratio", "", "{:.2f}", [](const L& l) { return l.seconds / l.compared_seconds; }},
  };
  std::vector<L> lines;
  for (const auto& [method, compared] : results.overhead_of) {
    for (const Run* run : results.of(method)) {
      for (const Run* bare : results.of(compared)) {
        const Timing *time = results.timing_of(*run), *bare_time = results.timing_of(*bare);
        if (bare->counters.elements != run->counters.elements || !time || !bare_time) continue;
        lines.push_back({method, compared, run->counters.elements, time->median, bare_time->median});
      }
    }
  }
  return table_of(results.title, columns, lines,
                  "Median CPU time of whole runs in the same session, interleaved at random.");
}

Table precision_details(const GridResults& results) {
  using L = GridLine;
  const std::vector<Column<L>> columns = {
      {"method", of_run(&Run::method)},
      {"setting", "", "{}", [](const L& l) { return l.run->setting.value(); }},
      {"error", "", "{:.2e}", of_run(&Run::error)},
      {"median", "ms", "{:.4f}", time_of(&Timing::median)},
      {"minimum", "ms", "{:.4f}", time_of(&Timing::minimum)},
      {"lower quartile", "ms", "{:.4f}", time_of(&Timing::lower_quartile)},
      {"upper quartile", "ms", "{:.4f}", time_of(&Timing::upper_quartile)},
      {"repetitions", "", "{}",
       [](const L& l) { return l.timing ? std::optional(l.timing->repetitions) : std::nullopt; }},
      {"peak heap", "kB", "{:.1f}", [&results](const L& l) { return results.peak_bytes_of(*l.run) / 1e3; }},
      {"steps", "", "{}", counter(&Counters::steps)},
      {"elements", "", "{}", counter(&Counters::elements)},
      {"force evals", "", "{}", counter(&Counters::force_evaluations)},
      {"Newton its", "", "{}", counter(&Counters::inner_iterations)},
      {"factorizations", "", "{}", counter(&Counters::matrix_factorizations)},
      {"linear solves", "", "{}", counter(&Counters::linear_solves)},
      {"LCPs", "", "{}", counter(&Counters::complementarity_solves)},
      {"events", "", "{}", of_run(&Run::detected_events)},
      {"status", of_run(&Run::status)},
      {"reason", of_run(&Run::message)},
      {"command", [](const L& l) { return l.run->command(); }},
  };
  std::vector<L> lines;
  for (const auto& method : results.methods()) {
    for (const Run* run : results.of(method)) lines.emplace_back(results, *run);
  }
  Table table = table_of("Speed against error", columns, lines);
  for (const L& line : lines) table.row_ids.push_back(row_id(results, *line.run));
  return table;
}

}  // namespace ricochet
