#include "reports/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "reports/order_fit.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

std::string microseconds_per_step(const Record& record) {
  if (!record.timing || record.counters.steps == 0) return "-";
  return fmt::format("{:.3f}", record.timing->median * 1e6 / static_cast<double>(record.counters.steps));
}

}  // namespace

Table order_summary(const Results& results) {
  Table table;
  table.title = "Observed orders";
  table.columns = {{"method", true}, {"nominal"}, {"fitted slope"}, {"95 % interval"},    {"scatter"},
                   {"window N_sim"}, {"points"},  {"us/step"},      {"largest residual"}, {"solved"}};
  for (const auto& method : results.methods()) {
    const auto runs = results.of(method);
    if (runs.front()->steps == 0) continue;  // error-controlled: no step length to fit against
    std::vector<double> times;
    double residual = -1;
    int solved = 0;
    for (const Record* run : runs) {
      solved += run->succeeded();
      if (run->timing && run->counters.steps > 0)
        times.push_back(run->timing->median * 1e6 / static_cast<double>(run->counters.steps));
      if (run->max_residual > residual) residual = run->max_residual;
    }
    const auto fit = fit_order(runs);
    const double time = median(times);
    table.rows.push_back({method, fmt::format("{:g}", runs.front()->nominal_order),
                          fit ? fmt::format("{:.2f}", fit->slope) : "not asymptotic",
                          fit ? fmt::format("{:.2f} .. {:.2f}", fit->lower(), fit->upper()) : "-",
                          fit ? fmt::format("{:.2f}", fit->scatter) : "-",
                          fit ? fmt::format("{} .. {}", fit->first_steps, fit->last_steps) : "-",
                          fit ? fmt::format("{}/{}", fit->used, fit->attempted) : fmt::format("-/{}", runs.size()),
                          std::isfinite(time) ? fmt::format("{:.3f}", time) : "-",
                          residual >= 0 ? scientific(residual, 2) : "-", fmt::format("{}/{}", solved, runs.size())});
  }
  table.note =
      "Slope of log10(error) over log10(step length); the window follows one rule for all methods "
      "(reports/order_fit.h). "
      "The interval says how well the points lie on a line; scatter is in decades. us/step: median over the grid. " +
      results.error_measure().definition;
  return table;
}

Table order_details(const Results& results) {
  Table table;
  table.title = "All runs";
  table.columns = {{"method", true},     {"N_sim"},          {"h_bar"},       {"error"},
                   {"local slope"},      {"us/step"},        {"elements"},    {"force evals"},
                   {"Newton its"},       {"factorizations"}, {"LCPs"},        {"events"},
                   {"largest residual"}, {"status", true},   {"reason", true}};
  const auto add = [&](const Record& run, const std::optional<double>& slope) {
    const auto& c = run.counters;
    table.rows.push_back({run.method, run.setting(), scientific(run.h_bar, 2), scientific(run.error, 2),
                          slope ? fmt::format("{:.2f}", *slope) : "-", microseconds_per_step(run),
                          fmt::format("{}", c.elements), fmt::format("{}", c.force_evaluations),
                          fmt::format("{}", c.inner_iterations), fmt::format("{}", c.matrix_factorizations),
                          fmt::format("{}", c.complementarity_solves), fmt::format("{}", run.detected_events),
                          run.max_residual >= 0 ? scientific(run.max_residual, 2) : "-", run.status, run.message});
  };
  for (const auto& method : results.methods()) {
    const auto runs = results.of(method);
    const auto slopes = local_slopes(runs);
    for (std::size_t k = 0; k < runs.size(); ++k) {
      add(*runs[k], slopes[k]);
      for (const auto& other : results.records) {
        if (other.instead_of == method && other.setting() == runs[k]->setting()) add(other, std::nullopt);
      }
    }
  }
  table.note = "Runs above 20000 steps are not audited (residual '-'). " + results.error_measure().definition;
  return table;
}

Table failures(const Results& results) {
  Table table;
  table.title = "Runs without a solution";
  table.columns = {{"method", true}, {"setting"},           {"status", true},
                   {"reason", true}, {"answered by", true}, {"command", true}};
  int failed = 0;
  for (const auto& record : results.records) {
    if (record.succeeded() || !record.instead_of.empty()) continue;
    ++failed;
    std::string answer = "-";
    for (const auto& other : results.records) {
      if (other.instead_of == record.method && other.setting() == record.setting()) {
        answer = other.succeeded() ? fmt::format("{}: error {:.2e}", other.method, other.error)
                                   : fmt::format("{}: {}", other.method, other.status);
      }
    }
    table.rows.push_back({record.method, record.setting(), record.status, record.message, answer, record.command});
  }
  table.note = fmt::format("{} of {} runs.", failed,
                           std::count_if(results.records.begin(), results.records.end(),
                                         [](const Record& r) { return r.instead_of.empty(); }));
  return table;
}

Table time_to_reach(const Results& results, const std::vector<double>& levels) {
  Table table;
  table.title = "Time to reach an error";
  table.columns = {{"method", true}};
  for (const double level : levels) {
    table.columns.push_back({fmt::format("ms to {:.0e}", level)});
    table.columns.push_back({"x fastest"});
  }
  std::map<std::string, std::vector<double>> times;
  std::vector<double> fastest(levels.size(), std::numeric_limits<double>::infinity());
  for (const auto& method : results.methods()) {
    for (std::size_t k = 0; k < levels.size(); ++k) {
      double best = std::numeric_limits<double>::infinity();
      for (const Record* run : results.of(method)) {
        if (run->has_error() && run->timing && run->error <= levels[k]) best = std::min(best, run->timing->median);
      }
      times[method].push_back(best);
      fastest[k] = std::min(fastest[k], best);
    }
  }
  for (const auto& method : results.methods()) {
    std::vector<std::string> row{method};
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const double time = times[method][k];
      row.push_back(std::isfinite(time) ? fmt::format("{:.3f}", time * 1e3) : "not reached");
      row.push_back(std::isfinite(time) ? fmt::format("{:.1f}", time / fastest[k]) : "-");
    }
    table.rows.push_back(row);
  }
  table.note = "Shortest median CPU time of a run whose error is at most the level; nothing is interpolated. " +
               results.error_measure().definition;
  return table;
}

Table overhead(const Results& results) {
  Table table;
  table.title = results.header.value("title", "Cost beside another method");
  table.columns = {{"method", true}, {"compared with", true}, {"elements"},
                   {"ns/element"},   {"ns/element compared"}, {"ratio"}};
  for (const auto& [method, other] : results.header.at("overhead_of").items()) {
    const std::string compared = other;
    for (const Record* run : results.of(method)) {
      for (const Record* bare : results.of(compared)) {
        if (bare->counters.elements != run->counters.elements || !run->timing || !bare->timing) continue;
        const auto elements = static_cast<double>(run->counters.elements);
        table.rows.push_back({method, compared, fmt::format("{}", run->counters.elements),
                              fmt::format("{:.1f}", run->timing->median * 1e9 / elements),
                              fmt::format("{:.1f}", bare->timing->median * 1e9 / elements),
                              fmt::format("{:.2f}", run->timing->median / bare->timing->median)});
      }
    }
  }
  table.note = "Median CPU time of whole runs in the same session, interleaved at random.";
  return table;
}

Table precision_details(const Results& results) {
  Table table;
  table.title = "Speed against error";
  table.columns = {{"method", true}, {"setting"},     {"error"},       {"median ms"},   {"minimum ms"},
                   {"quartiles ms"}, {"repetitions"}, {"force evals"}, {"status", true}};
  for (const auto& method : results.methods()) {
    for (const Record* run : results.of(method)) {
      const auto& t = run->timing;
      table.rows.push_back({method, run->setting(), scientific(run->error, 2),
                            t ? fmt::format("{:.4f}", t->median * 1e3) : "-",
                            t ? fmt::format("{:.4f}", t->minimum * 1e3) : "-",
                            t ? fmt::format("{:.4f} .. {:.4f}", t->lower_quartile * 1e3, t->upper_quartile * 1e3) : "-",
                            t ? fmt::format("{}", t->repetitions) : "-",
                            fmt::format("{}", run->counters.force_evaluations), run->status});
    }
  }
  return table;
}

}  // namespace ricochet
