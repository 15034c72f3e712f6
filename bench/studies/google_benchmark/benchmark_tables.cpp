#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <span>

#include "bench/studies/google_benchmark/benchmark_rows.h"
#include "problems/split.h"
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
  const auto measured = rows_where(rows, &BenchmarkRow::succeeded);
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
  const auto failed = rows_where(rows, [](const R& row) { return !row.succeeded(); });
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

/// The seconds of an item, or of an iteration where items are not counted.
double seconds_of_item(const BenchmarkRow& row) {
  return std::isfinite(row.items_per_second) ? row.seconds_per_item() : row.cpu_seconds;
}

bool is_drawn(const BenchmarkRow& row) {
  const double seconds = seconds_of_item(row);
  return row.succeeded() && std::isfinite(seconds) && seconds > 0;
}

/// Curves of the benchmarks that have several N.
std::vector<GrowthCurve> curves_over_n(const std::vector<BenchmarkRow>& rows) {
  std::vector<GrowthCurve> curves;
  for (const auto& row : rows) {
    const auto name = BenchmarkName::parse(row.name);
    if (!is_drawn(row) || !(name.n > 0)) continue;
    const auto is_its = [&](const GrowthCurve& curve) { return curve.panel == name.scene && curve.name == name.curve; };
    auto curve = std::ranges::find_if(curves, is_its);
    if (curve == curves.end()) curve = curves.insert(curve, {name.scene, name.curve, {}});
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
    const std::string curve = BenchmarkName::parse(row.name).curve;
    auto found = std::ranges::find(list, curve, &Speeds::curve);
    if (found == list.end()) found = list.insert(found, {curve, {}});
    found->rates.push_back(1 / seconds_of_item(row));
  }
  std::ranges::stable_sort(list, {}, &Speeds::median);
  return list;
}

Chart speed_chart(const std::vector<Speeds>& all, const std::string& rate, const std::string& file) {
  constexpr std::size_t kMostLines = 100;
  constexpr int kLineHeight = 22;  // [px]
  const std::size_t count = std::min(all.size(), kMostLines);
  Chart chart{
      .name = "speed",
      .file = file,
      .title = "Speed",
      .caption = "Right is faster. A dot per benchmark; the cross is the median of several, which are other scenes.",
      .width = 700,
      .height = kLineHeight * static_cast<int>(count)};
  if (count < all.size()) chart.caption += fmt::format(" The fastest {} of {}.", count, all.size());
  Chart::Panel panel{.title = "", .x = {.label = rate, .is_log = true}, .y = {.label = ""}};
  Chart::Points medians;
  std::vector<std::string> families;
  for (const Speeds& line : std::span(all).last(count)) {
    const auto y = static_cast<double>(panel.y.names.size());
    panel.y.names.push_back(line.curve);
    if (line.rates.size() > 1) medians.emplace_back(line.median(), y);
    auto family = std::ranges::find(families, line.family());
    if (family == families.end()) family = families.insert(family, line.family());
    Chart::Points dots;
    for (const double r : line.rates) dots.emplace_back(r, y);
    panel.add("", CurveLook::plain(static_cast<std::size_t>(family - families.begin())), Chart::Drawn::marks, dots);
  }
  panel.add("", {.colour = 7, .symbol = 4}, Chart::Drawn::marks, medians);
  chart.panels = {panel};
  return chart;
}

}  // namespace

std::optional<Chart> benchmark_chart(const std::vector<BenchmarkRow>& rows, const std::string& file) {
  const bool have_items = std::ranges::all_of(
      rows, [](const BenchmarkRow& row) { return !is_drawn(row) || std::isfinite(row.items_per_second); });
  if (const auto curves = curves_over_n(rows); !curves.empty())
    return growth_chart(curves, file, have_items ? "Time of an item" : "Time of an iteration", "N",
                        have_items ? "microseconds per item" : "microseconds per iteration");
  const auto speeds = speeds_of(rows);
  if (speeds.empty()) return {};
  return speed_chart(speeds, have_items ? "items per second" : "iterations per second", file);
}

}  // namespace ricochet
