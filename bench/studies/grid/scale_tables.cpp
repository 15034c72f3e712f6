#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "bench/studies/grid/scale_rows.h"

namespace ricochet {
namespace {

double size_of(const Run& run) {
  return run.parameters.at("n");
}

bool is_same_curve(const Run& a, const Run& b) {
  return a.scene == b.scene && a.method == b.method;
}

/// A run that succeeded, or, with `fitted`, the growth along the curve above it.
struct ScaleLine {
  Run run;
  int fitted = 0;  ///< runs; 0: a line of a run
  std::string time, iterations;
};

/// The growth over the runs from `first` up to before `last`, where something touches.
ScaleLine growth_of(const std::vector<Run>& runs, std::size_t first, std::size_t last) {
  std::vector<double> n, time, iterations;
  for (std::size_t i = first; i < last; ++i) {
    if (!runs[i].succeeded() || runs[i].value("active") == 0) continue;
    n.push_back(runs[i].value("active"));
    time.push_back(step_seconds(runs[i]));
    iterations.push_back(runs[i].value("iterations"));
  }
  const bool has_iterations = std::ranges::all_of(iterations, [](double x) { return x > 0; });
  return {runs[first], static_cast<int>(n.size()), growth_text("n", n, time),
          has_iterations ? growth_text("n", n, iterations) : "-"};
}

/// Cell with a value of the run; empty if the line is a fit.
auto of_line(std::function<double(const Run&)> value, const char* format = "{:g}") {
  return [=](const ScaleLine& line) { return line.fitted ? "" : cell_text(format, value(line.run)); };
}

auto value_of(const char* name) {
  return [=](const Run& run) { return run.value(name); };
}

}  // namespace

double step_seconds(const Run& run) {
  return run.has_time() ? run.timing.median / run.setting.steps : std::numeric_limits<double>::quiet_NaN();
}

Table scale_table(const std::vector<Run>& runs) {
  using L = ScaleLine;
  static const std::vector<Column<L>> columns = {
      {"scene", [](const L& l) { return l.run.scene; }},
      {"method", [](const L& l) { return l.run.method; }},
      {"bodies", "", "{}", of_line(size_of)},
      {"possible contacts", "", "{}", of_line(value_of("contacts"))},
      {"active", "", "{}",
       [](const L& l) {
         return fmt::format("{}{:g}", l.fitted ? "fit of " : "", l.fitted ? l.fitted : l.run.value("active"));
       }},
      {"us per step", "", "{}",
       [](const L& l) { return l.fitted ? l.time : cell_text("{:.3g}", 1e6 * step_seconds(l.run)); }},
      {"events", "", "{}", of_line([](const Run& run) { return static_cast<double>(run.counters.events); })},
      {"solves per step", "", "{}", of_line(value_of("solves"), "{:.3g}")},
      {"iterations per step", "", "{}",
       [](const L& l) { return l.fitted ? l.iterations : fmt::format("{:.3g}", l.run.value("iterations")); }},
  };
  std::vector<ScaleLine> lines;
  std::size_t first = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].succeeded()) lines.push_back({.run = runs[i], .time = {}, .iterations = {}});
    if (i + 1 < runs.size() && is_same_curve(runs[i], runs[i + 1])) continue;
    if (ScaleLine growth = growth_of(runs, first, i + 1); growth.fitted > 0) lines.push_back(std::move(growth));
    first = i + 1;
  }
  return without_empty(
      table_of(
          "Time of a step over the number of active contacts", columns, lines,
          "Median CPU time; a single run if it takes more than 2 s. Active: contacts that touch at the end. Solves: "
          "contact problems, or systems of Newton's method. Iterations: inner iterations and pivots. The exponents are "
          "fitted to the successful runs."),
      {"us per step"});
}

Table scale_failures(const std::vector<Run>& runs) {
  using R = Run;
  static const std::vector<Column<R>> columns = {
      {"scene", &R::scene},   {"bodies", "", "{:g}", size_of}, {"method", &R::method},
      {"status", &R::status}, {"reason", &R::message},
  };
  const auto failed = rows_where(runs, [](const R& run) { return !run.succeeded(); });
  return table_of("Runs without a result", columns, failed);
}

std::vector<GrowthCurve> scale_curves(const std::vector<Run>& runs) {
  std::vector<GrowthCurve> curves;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == 0 || !is_same_curve(runs[i - 1], runs[i])) curves.push_back({runs[i].scene, runs[i].method, {}});
    if (runs[i].succeeded() && runs[i].value("active") > 0)
      curves.back().points.emplace_back(runs[i].value("active"), 1e6 * step_seconds(runs[i]));
  }
  return curves;
}

}  // namespace ricochet
