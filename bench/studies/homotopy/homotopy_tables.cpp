#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/studies/homotopy/homotopy_rows.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

// A stretch of steps that ends farther from the pivoting solver has followed another solution of the equations.
constexpr double kOther = 1e-6;

/// The rows of one family and solver together.
struct HomotopyLine {
  HomotopyRow all;
  int runs = 0, failed_runs = 0;
  std::vector<double> errors;

  void add(const HomotopyRow& row) {
    ++runs;
    failed_runs += row.failed > 0;
    all.steps += row.steps;
    all.failed += row.failed;
    all.retried += row.retried;
    const auto append = [&](std::vector<double> HomotopyRow::*list) {
      (all.*list).insert((all.*list).end(), (row.*list).begin(), (row.*list).end());
    };
    append(&HomotopyRow::free_milliseconds);
    append(&HomotopyRow::impact_milliseconds);
    append(&HomotopyRow::distances);
    if (std::isfinite(row.error)) errors.push_back(row.error);
  }
};

std::vector<HomotopyLine> lines_of(const std::vector<HomotopyRow>& rows) {
  std::vector<HomotopyLine> lines;
  for (const auto& row : rows) {
    const auto known = std::ranges::find_if(lines, [&](const HomotopyLine& line) {
      return line.all.family == row.family && line.all.solver == row.solver;
    });
    HomotopyLine& line = known == lines.end() ? lines.emplace_back() : *known;
    line.all.family = row.family;
    line.all.solver = row.solver;
    line.add(row);
  }
  return lines;
}

}  // namespace

Table homotopy_table(const std::vector<HomotopyRow>& rows) {
  using L = HomotopyLine;
  static const std::vector<Column<L>> columns = {
      {"family", [](const L& l) { return l.all.family; }},
      {"solver", [](const L& l) { return l.all.solver; }},
      {"runs failed", "", "{}", [](const L& l) { return fmt::format("{} of {}", l.failed_runs, l.runs); }},
      {"steps failed", "", "{}", [](const L& l) { return fmt::format("{} of {}", l.all.failed, l.all.steps); }},
      {"tried again", "", "{}", [](const L& l) { return l.all.retried; }},
      {"free step", "ms", "{:.3g}", [](const L& l) { return median(l.all.free_milliseconds); }},
      {"impact step", "ms", "{:.3g}", [](const L& l) { return median(l.all.impact_milliseconds); }},
      {"distance, median", "", "{:.1e}", [](const L& l) { return median(l.all.distances); }},
      {"distance, largest", "", "{:.1e}", [](const L& l) { return quantile(l.all.distances, 1); }},
      {"other solutions", "", "{}",
       [](const L& l) { return std::ranges::count_if(l.all.distances, [](double d) { return d > kOther; }); }},
      {"error", "", "{:.1e}", [](const L& l) { return median(l.errors); }},
  };
  return without_empty(
      table_of("FESD-J by homotopy and by pivoting", columns, lines_of(rows),
               "Times: CPU, medians. Distance: of (q, v) to the pivoting solver, at the end of every stretch "
               "of steps. Error: of the final state, median of complete runs."),
      {"free step [ms]", "impact step [ms]"});
}

Table homotopy_failures(const std::vector<HomotopyRow>& rows) {
  struct Line {
    const HomotopyRow* row;
    std::string text;
  };
  static const std::vector<Column<Line>> columns = {
      {"family", [](const Line& l) { return l.row->family; }},
      {"stages", "", "{}", [](const Line& l) { return l.row->stages; }},
      {"N_sim", "", "{}", [](const Line& l) { return l.row->run_steps; }},
      {"solver", [](const Line& l) { return l.row->solver; }},
      {"what", &Line::text},
  };
  std::vector<Line> lines;
  for (const auto& row : rows) {
    for (const auto& failure : row.failures) lines.push_back({&row, failure});
    if (row.solves_infeasible) lines.push_back({&row, "solves the step that pivoting does not"});
  }
  return table_of("Steps that one of the solvers does not find", columns, lines);
}

}  // namespace ricochet
