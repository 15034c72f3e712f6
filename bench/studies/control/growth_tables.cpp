#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/studies/control/growth_rows.h"

namespace ricochet {
namespace {

/// A run, or, with `fitted`, the growth of what was solved above it.
struct GrowthLine {
  ControlGrowth run;
  int fitted = 0;  ///< runs; 0: a line of a run
  std::string variables, iterations, derivatives, rest, whole, seconds, again;

  bool is_fit() const { return fitted > 0; }
};

double per_iteration(const ControlGrowth& run, double seconds) {
  return seconds / std::max(run.iterations, 1);
}
double derivatives_of(const ControlGrowth& run) {
  return per_iteration(run, run.derivative_seconds);
}
double rest_of(const ControlGrowth& run) {
  return per_iteration(run, run.seconds - run.derivative_seconds);
}

double together_of(const ControlGrowth& run) {
  return per_iteration(run, run.seconds);
}

bool is_same_series(const ControlGrowth& a, const ControlGrowth& b) {
  return a.problem == b.problem && a.method == b.method;
}

/// Growth over the solved runs in [first, last), all of one problem and method.
GrowthLine growth_of(const std::vector<ControlGrowth>& runs, std::size_t first, std::size_t last) {
  std::vector<double> N, variables, iterations, derivatives, rest, whole, seconds, again_N, again;
  for (std::size_t i = first; i < last; ++i) {
    const ControlGrowth& run = runs[i];
    if (!run.succeeded()) continue;
    N.push_back(run.intervals);
    variables.push_back(run.variables);
    iterations.push_back(run.iterations);
    derivatives.push_back(derivatives_of(run));
    rest.push_back(rest_of(run));
    whole.push_back(together_of(run));
    seconds.push_back(run.seconds);
    if (!run.is_short_again()) continue;
    again_N.push_back(run.intervals);
    again.push_back(run.again_seconds);
  }
  return {.run = runs[first],
          .fitted = static_cast<int>(N.size()),
          .variables = growth_text("N", N, variables),
          .iterations = growth_text("N", N, iterations),
          .derivatives = growth_text("N", N, derivatives),
          .rest = growth_text("N", N, rest),
          .whole = growth_text("N", N, whole),
          .seconds = growth_text("N", N, seconds),
          .again = growth_text("N", again_N, again)};
}

std::vector<GrowthLine> lines_of(const std::vector<ControlGrowth>& runs) {
  std::vector<GrowthLine> lines;
  std::size_t first = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    lines.emplace_back().run = runs[i];
    if (i + 1 < runs.size() && is_same_series(runs[i + 1], runs[i])) continue;
    if (GrowthLine growth = growth_of(runs, first, i + 1); i > first && growth.is_fit()) lines.push_back(growth);
    first = i + 1;
  }
  return lines;
}

/// The text of a fit, or what the format makes of the run.
auto fit_or(std::string GrowthLine::*fit, const char* format, auto value) {
  return [=](const GrowthLine& line) {
    return line.is_fit() ? line.*fit : cell_text(format, std::invoke(value, line.run));
  };
}

std::string how_again(const GrowthLine& line) {
  if (line.is_fit()) return "";
  if (!line.run.is_solved_again()) return line.run.again_status.empty() ? "-" : line.run.again_status;
  if (line.run.method != kHomotopy) return line.run.method;
  return line.run.again_kept_branch ? "branch" : "homotopy";
}

}  // namespace

Table growth_table(const std::vector<ControlGrowth>& runs) {
  using L = GrowthLine;
  using R = ControlGrowth;
  static const std::vector<Column<L>> columns = {
      {"problem", [](const L& l) { return l.run.problem; }},
      {"method", [](const L& l) { return l.run.method; }},
      {"N", "", "{}",
       [](const L& l) { return l.is_fit() ? fmt::format("{} solved", l.fitted) : fmt::format("{}", l.run.intervals); }},
      {"variables", "", "{}", fit_or(&L::variables, "{}", &R::variables)},
      {"pairs", "", "{}",
       [](const L& l) { return l.is_fit() || l.run.pairs == 0 ? "" : fmt::format("{}", l.run.pairs); }},
      {"iterations", "", "{}", fit_or(&L::iterations, "{}", &R::iterations)},
      {"derivatives", "ms/it.", "{}",
       fit_or(&L::derivatives, "{:.3g}", [](const R& run) { return 1e3 * derivatives_of(run); })},
      {"linear solver and rest", "ms/it.", "{}",
       fit_or(&L::rest, "{:.3g}", [](const R& run) { return 1e3 * rest_of(run); })},
      {"together", "ms/it.", "{}", fit_or(&L::whole, "{:.3g}", [](const R& run) { return 1e3 * together_of(run); })},
      {"seconds", "", "{}", fit_or(&L::seconds, "{:.3g}", &R::seconds)},
      {"cost", "", "{:.6g}", [](const L& l) { return when(!l.is_fit() && l.run.cost > 0, l.run.cost); }},
      {"status", [](const L& l) { return l.is_fit() ? "fit" : l.run.status; }},
      {"again", how_again},
      {"again", "s", "{}",
       [](const L& l) {
         return l.is_fit() ? l.again : cell_text("{:.3g}", when(l.run.is_solved_again(), l.run.again_seconds));
       }},
      {"again, iterations", "", "{}",
       [](const L& l) {
         return l.is_fit() ? "" : cell_text("{}", when(l.run.is_solved_again(), l.run.again_iterations));
       }},
  };
  return without_empty(
      table_of(
          "Growth of the work with the number of control intervals", columns, lines_of(runs),
          "Seconds: wall time without the guess. Again: after one interval the plant is "
          "disturbed and the rest is planned again, on the same branch, or by a homotopy if that branch has no "
          "solution, or by shooting. The exponents are fitted to the solved runs, those of \"again\" without the runs "
          "that needed a homotopy."),
      {"derivatives [ms/it.]", "linear solver and rest [ms/it.]", "together [ms/it.]", "seconds", "cost", "again [s]"});
}

std::vector<Comparison> growth_comparisons(const std::vector<ControlGrowth>& runs) {
  std::vector<Comparison> comparisons;
  for (const auto& problem : different(runs, &ControlGrowth::problem)) {
    const auto of_method = [&](const char* method) {
      return rows_where(runs, [&](const ControlGrowth& r) { return r.problem == problem && r.method == method; });
    };
    const auto homotopy = of_method(kHomotopy), shooting = of_method(kShooting);
    if (homotopy.empty() || shooting.empty()) continue;
    const auto count = [](const auto& of) { return rows_where(of, &ControlGrowth::succeeded).size(); };
    comparisons.push_back({problem, "solved", fmt::format("{} of {}", count(homotopy), homotopy.size()),
                           fmt::format("{} of {}", count(shooting), shooting.size()),
                           static_cast<double>(count(shooting))});
    const auto exponent = [](const std::vector<ControlGrowth>& of, auto value) {
      std::vector<double> N, y;
      for (const auto& run : rows_where(of, &ControlGrowth::succeeded)) {
        N.push_back(run.intervals);
        y.push_back(static_cast<double>(std::invoke(value, run)));
      }
      return growth_exponent(N, y);
    };
    const auto add_exponent = [&](const char* quantity, auto value) {
      const double own = exponent(shooting, value);
      if (!std::isfinite(own)) return;
      comparisons.push_back(
          {problem, quantity, cell_text("{:.2f}", exponent(homotopy, value)), cell_text("{:.2f}", own), own});
    };
    if (shooting.front().seconds > 0) add_exponent("exponent of the time per iteration", together_of);
    add_exponent("exponent of the iterations", &ControlGrowth::iterations);
    // The cost on the most intervals against that on a quarter of them.
    const auto refined = [](const std::vector<ControlGrowth>& of) {
      for (const auto& run : of) {
        if (run.succeeded() && 4 * run.intervals == of.back().intervals && of.back().succeeded())
          return of.back().cost / run.cost;
      }
      return std::numeric_limits<double>::quiet_NaN();
    };
    if (const double own = refined(shooting); std::isfinite(own))
      comparisons.push_back({problem, "cost of N by that of N / 4", cell_text("{:.4f}", refined(homotopy)),
                             cell_text("{:.4f}", own), own});
  }
  return comparisons;
}

std::vector<GrowthCurve> growth_curves(const std::vector<ControlGrowth>& runs) {
  std::vector<GrowthCurve> curves;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == 0 || !is_same_series(runs[i], runs[i - 1])) {
      for (const char* panel : {"of an iteration", "of a re-solve on the same branch, or by shooting"})
        curves.push_back({panel, runs[i].problem + (runs[i].method == kHomotopy ? "" : ", " + runs[i].method), {}});
    }
    const ControlGrowth& run = runs[i];
    if (!run.succeeded()) continue;
    const auto last = curves.end() - 2;
    last->points.emplace_back(run.intervals, together_of(run));
    if (run.is_short_again()) (last + 1)->points.emplace_back(run.intervals, run.again_seconds);
  }
  return curves;
}

Table homotopy_steps(const std::vector<ControlGrowth>& runs) {
  struct Line {
    ControlGrowth run;
    ControlGrowth::Step step;
  };
  static const std::vector<Column<Line>> columns = {
      {"problem", [](const Line& l) { return l.run.problem; }},
      {"N", "", "{}", [](const Line& l) { return l.run.intervals; }},
      {"sigma", "", "{:.1e}", [](const Line& l) { return l.step.sigma; }},
      {"iterations", "", "{}", [](const Line& l) { return l.step.iterations; }},
      {"seconds", "", "{:.2f}", [](const Line& l) { return l.step.seconds; }},
      {"max min(G, H)", "", "{:.1e}", [](const Line& l) { return l.step.complementarity; }},
      {"solved", [](const Line& l) { return l.step.is_solved ? "yes" : "no"; }},
  };
  std::vector<Line> lines;
  for (const auto& run : runs) {
    for (const auto& step : run.steps) lines.push_back({run, step});
  }
  return without_empty(table_of("Steps of the homotopies", columns, lines,
                                "What a run took more than its steps is the crossover to exact complementarity."),
                       {"seconds"});
}

}  // namespace ricochet
