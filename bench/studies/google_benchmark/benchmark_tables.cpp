#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "bench/studies/google_benchmark/benchmark_rows.h"
#include "problems/split.h"
#include "reports/gnuplot.h"
#include "reports/growth.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

std::vector<std::string> parts_of(const std::string& name) {
  return split(name, '/');
}

bool is_number(const std::string& part) {
  return !part.empty() && part.size() < 10 &&
         std::ranges::all_of(part, [](unsigned char c) { return std::isdigit(c); });
}

/// METHOD/SCENE/N or METHOD/SCENE/N/WHAT.
bool has_our_form(const BenchmarkRow& row) {
  const auto parts = parts_of(row.name);
  return parts.size() == 3 || (parts.size() == 4 && is_number(parts[2]));
}

/// A whole number with all of its digits.
std::string counter_text(double value) {
  if (!std::isfinite(value)) return "-";
  return value == std::round(value) && std::abs(value) < 1e15 ? fmt::format("{:.0f}", value)
                                                              : fmt::format("{:.3g}", value);
}

}  // namespace

BenchmarkName BenchmarkName::parse(const std::string& name) {
  const auto parts = parts_of(name);
  std::size_t at_n = parts.size();
  for (std::size_t k = 1; k < parts.size(); ++k) {
    if (is_number(parts[k])) at_n = k;
  }
  BenchmarkName parsed;
  if (at_n < parts.size()) parsed.n = std::stod(parts[at_n]);
  const std::size_t at_scene = parts.size() >= 3 && at_n != 1 ? 1 : parts.size();
  if (at_scene < parts.size()) parsed.scene = parts[at_scene];
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (k == at_n || k == at_scene) continue;
    parsed.curve += (parsed.curve.empty() ? "" : "/") + parts[k];
  }
  return parsed;
}

Table benchmark_table(const std::vector<BenchmarkRow>& rows, const std::string& note) {
  std::vector<BenchmarkRow> measured;
  std::ranges::copy_if(rows, std::back_inserter(measured), &BenchmarkRow::succeeded);
  using R = BenchmarkRow;
  std::vector<Column<R>> columns;
  if (std::ranges::all_of(measured, has_our_form)) {
    const std::vector<std::string> headers = {"method", "scene", "N", "what"};
    const bool has_what = std::ranges::any_of(measured, [](const R& row) { return parts_of(row.name).size() == 4; });
    for (std::size_t k = 0; k < (has_what ? 4 : 3); ++k) {
      const auto part = [k](const R& row) {
        const auto parts = parts_of(row.name);
        return k < parts.size() ? parts[k] : std::string("-");
      };
      if (headers[k] == "N")
        columns.emplace_back(headers[k], "", "{}", part);
      else
        columns.emplace_back(headers[k], part);
    }
  } else {
    columns.emplace_back("benchmark", &R::name);
  }
  columns.emplace_back("real time", "us", "{:.4g}", [](const R& row) { return 1e6 * row.real_seconds; });
  columns.emplace_back("CPU time", "us", "{:.4g}", [](const R& row) { return 1e6 * row.cpu_seconds; });
  if (std::ranges::any_of(measured, [](const R& row) { return std::isfinite(row.spread); }))
    columns.emplace_back("spread", "%", "{:.2g}", [](const R& row) { return 100 * row.spread; });
  if (std::ranges::any_of(measured, [](const R& row) { return std::isfinite(row.items_per_second); }))
    columns.emplace_back("items", "1/s", "{:.4g}", &R::items_per_second);
  std::set<std::string> counters;
  for (const R& row : measured) {
    for (const auto& [name, value] : row.counters) counters.insert(name);
  }
  for (const auto& counter : counters)
    columns.emplace_back(counter, "", "{}", [counter](const R& row) {
      const auto found = row.counters.find(counter);
      return found == row.counters.end() ? std::string("-") : counter_text(found->second);
    });
  return table_of("Times and counters", columns, measured, note);
}

Table benchmark_failures(const std::vector<BenchmarkRow>& rows) {
  using R = BenchmarkRow;
  static const std::vector<Column<R>> columns = {{"benchmark", &R::name}, {"reason", &R::error}};
  std::vector<R> failed;
  std::ranges::copy_if(rows, std::back_inserter(failed), [](const R& row) { return !row.succeeded(); });
  return table_of("Benchmarks without a time", columns, failed);
}

Table complexity_table(const std::vector<ComplexityRow>& rows) {
  using R = ComplexityRow;
  static const std::vector<Column<R>> columns = {
      {"benchmark", &R::name},
      {"growth", &R::big_o},
      {"CPU time", "us", "{:.4g}", [](const R& row) { return 1e6 * row.cpu_seconds; }},
      {"real time", "us", "{:.4g}", [](const R& row) { return 1e6 * row.real_seconds; }},
      {"residual", "%", "{:.2g}", [](const R& row) { return 100 * row.rms; }},
  };
  return table_of("Growth of the time", columns, rows,
                  "As Google Benchmark fits it: coefficients of the term, and the root mean square of what is left.");
}

namespace {

/// Without the mark at which a text of gnuplot ends.
std::string drawn(std::string text) {
  std::ranges::replace(text, '\'', '_');
  return text;
}

/// The seconds of an item, or of an iteration where items are not counted.
double seconds_of_item(const BenchmarkRow& row) {
  return std::isfinite(row.items_per_second) ? row.seconds_per_item() : row.cpu_seconds;
}

bool is_drawn(const BenchmarkRow& row) {
  const double seconds = seconds_of_item(row);
  return row.succeeded() && std::isfinite(seconds) && seconds > 0;
}

/// Those that have several N.
std::vector<GrowthCurve> curves_over_n(const std::vector<BenchmarkRow>& rows) {
  std::vector<GrowthCurve> curves;
  for (const auto& row : rows) {
    const auto name = BenchmarkName::parse(row.name);
    if (!is_drawn(row) || !(name.n > 0)) continue;
    const auto is_its = [&](const GrowthCurve& curve) {
      return curve.panel == drawn(name.scene) && curve.name == drawn(name.curve);
    };
    auto curve = std::ranges::find_if(curves, is_its);
    if (curve == curves.end()) curve = curves.insert(curve, {drawn(name.scene), drawn(name.curve), {}});
    curve->points.emplace_back(name.n, 1e6 * seconds_of_item(row));
  }
  for (auto& curve : curves) std::ranges::sort(curve.points);
  std::erase_if(curves,
                [](const GrowthCurve& curve) { return curve.points.front().first == curve.points.back().first; });
  return curves;
}

/// A line of the figure of speeds: a method on all scenes.
struct Speeds {
  std::string curve;
  std::vector<double> rates;  ///< [1/s]

  double median() const { return quantile(rates, 0.5); }
  /// "fesd" of "fesd:gauss:3": of one colour
  std::string family() const { return curve.substr(0, curve.find_first_of(":,/")); }
};

std::vector<Speeds> speeds_of(const std::vector<BenchmarkRow>& rows) {
  std::vector<Speeds> list;
  for (const auto& row : rows) {
    if (!is_drawn(row)) continue;
    const std::string curve = drawn(BenchmarkName::parse(row.name).curve);
    auto found = std::ranges::find(list, curve, &Speeds::curve);
    if (found == list.end()) found = list.insert(found, {curve, {}});
    found->rates.push_back(1 / seconds_of_item(row));
  }
  std::ranges::stable_sort(list, {}, &Speeds::median);
  return list;
}

Figure draw_speeds(const FigureFolder& folder, const std::vector<Speeds>& all, const std::string& rate,
                   const std::string& file) {
  constexpr std::size_t kMostLines = 100;
  const std::size_t count = std::min(all.size(), kMostLines);
  const std::vector<Speeds> list(all.end() - static_cast<std::ptrdiff_t>(count), all.end());
  const auto families = [&] {
    std::vector<std::string> names;
    for (const auto& line : list) {
      if (std::ranges::find(names, line.family()) == names.end()) names.push_back(line.family());
    }
    return names;
  }();
  std::string tics;
  Points medians;
  std::vector<Points> points(families.size());
  for (std::size_t k = 0; k < list.size(); ++k) {
    const double y = static_cast<double>(k + 1);
    tics += fmt::format("{}{} {}", k == 0 ? "" : ", ", gnuplot_text(list[k].curve), y);
    if (list[k].rates.size() > 1) medians.emplace_back(list[k].median(), y);
    auto& of_family = points[std::ranges::find(families, list[k].family()) - families.begin()];
    for (const double r : list[k].rates) of_family.emplace_back(r, y);
  }
  Panel panel("speeds");
  for (std::size_t k = 0; k < families.size(); ++k) panel.add(points[k], k, "with points pt 7 ps 0.55");
  std::string script = gnuplot_head(980, 110 + 22 * static_cast<int>(count));
  script += fmt::format("set output '{}.svg'\nunset key\nset logscale x\nset format x '10^{{%T}}'\n", file);
  script += fmt::format("set xlabel '{}'\nset ytics noenhanced ({})\nset yrange [0.3:{}]\n", rate, tics,
                        static_cast<double>(count) + 0.7);
  std::string plot = panel.plot();
  script += panel.data();
  if (!medians.empty()) {
    script += data_block("medians", medians);
    plot.insert(plot.size() - 1, ", \\\n     $medians with points pt '|' ps 1.2 lc rgb '#000000' notitle");
  }
  folder.draw(file, script + plot);
  std::string caption =
      "Right is faster. A dot per benchmark; the bar is the median of several, which are other scenes.";
  if (count < all.size()) caption += fmt::format(" The fastest {} of {}.", count, all.size());
  return {file + ".svg", "Speed", caption};
}

}  // namespace

std::vector<Figure> benchmark_figures(const FigureFolder& folder, const std::vector<BenchmarkRow>& rows,
                                      const std::string& name) {
  const bool have_items = std::ranges::all_of(
      rows, [](const BenchmarkRow& row) { return !is_drawn(row) || std::isfinite(row.items_per_second); });
  if (const auto curves = curves_over_n(rows); !curves.empty())
    return {draw_growth(folder, curves, name, have_items ? "Time of an item" : "Time of an iteration", "N",
                        have_items ? "microseconds per item" : "microseconds per iteration")};
  const auto speeds = speeds_of(rows);
  if (speeds.empty()) return {};
  return {draw_speeds(folder, speeds, have_items ? "items per second" : "iterations per second", name)};
}

}  // namespace ricochet
