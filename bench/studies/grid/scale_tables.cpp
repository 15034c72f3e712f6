#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/grid/scale_rows.h"

namespace ricochet {
namespace {

bool is_same_curve(const ScaleRun& a, const ScaleRun& b) {
  return a.scene == b.scene && a.method == b.method;
}

/// A run that succeeded, or, with `fitted`, the growth along the curve above it.
struct ScaleLine {
  ScaleRun run;
  int fitted = 0;  ///< runs; 0: a line of a run
  std::string time, iterations;
};

/// The growth over the runs from `first` up to before `last`, where something touches.
ScaleLine growth_of(const std::vector<ScaleRun>& runs, std::size_t first, std::size_t last) {
  std::vector<double> n, time, iterations;
  for (std::size_t i = first; i < last; ++i) {
    if (!runs[i].succeeded() || runs[i].active == 0) continue;
    n.push_back(runs[i].active);
    time.push_back(runs[i].step_seconds);
    iterations.push_back(runs[i].iterations);
  }
  const bool has_iterations = std::ranges::all_of(iterations, [](double x) { return x > 0; });
  return {runs[first], static_cast<int>(n.size()), growth_text("n", n, time),
          has_iterations ? growth_text("n", n, iterations) : "-"};
}

/// A cell of a run's line; empty in a line of a fit.
template <class Value>
auto of_run(Value ScaleRun::*member, const char* format = "{}") {
  return [=](const ScaleLine& line) { return line.fitted ? "" : cell_text(format, line.run.*member); };
}

}  // namespace

Table scale_table(const std::vector<ScaleRun>& runs) {
  using L = ScaleLine;
  static const std::vector<Column<L>> columns = {
      {"scene", [](const L& l) { return l.run.scene; }},
      {"method", [](const L& l) { return l.run.method; }},
      {"bodies", "", "{}", of_run(&ScaleRun::size)},
      {"possible contacts", "", "{}", of_run(&ScaleRun::contacts)},
      {"active", "", "{}",
       [](const L& l) { return fmt::format("{}{}", l.fitted ? "fit of " : "", l.fitted ? l.fitted : l.run.active); }},
      {"us per step", "", "{}",
       [](const L& l) { return l.fitted ? l.time : cell_text("{:.3g}", 1e6 * l.run.step_seconds); }},
      {"events", "", "{}", of_run(&ScaleRun::events)},
      {"solves per step", "", "{}", of_run(&ScaleRun::solves, "{:.3g}")},
      {"iterations per step", "", "{}",
       [](const L& l) { return l.fitted ? l.iterations : fmt::format("{:.3g}", l.run.iterations); }},
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
      table_of("Time of a step over the number of active contacts", columns, lines,
               "CPU time, median; of runs of over 2 s, one. Active: contacts that touch at the end. Solves: contact "
               "problems, or systems of Newton's method; iterations: inner ones and pivots. The lines of exponents "
               "are fits over the runs that succeeded."),
      {"us per step"});
}

Table scale_failures(const std::vector<ScaleRun>& runs) {
  using R = ScaleRun;
  static const std::vector<Column<R>> columns = {
      {"scene", &R::scene},   {"bodies", "", "{}", &R::size}, {"method", &R::method},
      {"status", &R::status}, {"reason", &R::message},
  };
  std::vector<ScaleRun> failed;
  std::ranges::copy_if(runs, std::back_inserter(failed), [](const R& run) { return !run.succeeded(); });
  return table_of("Runs without a result", columns, failed);
}

std::vector<GrowthCurve> scale_curves(const std::vector<ScaleRun>& runs) {
  std::vector<GrowthCurve> curves;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == 0 || !is_same_curve(runs[i - 1], runs[i])) curves.push_back({runs[i].scene, runs[i].method, {}});
    if (runs[i].succeeded() && runs[i].active > 0)
      curves.back().points.emplace_back(runs[i].active, 1e6 * runs[i].step_seconds);
  }
  return curves;
}

}  // namespace ricochet
