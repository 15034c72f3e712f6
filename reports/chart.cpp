#include "reports/chart.h"

#include <algorithm>
#include <cmath>

namespace ricochet {

void Chart::Panel::add(const std::string& label, const CurveLook& look, Drawn drawn, const Points& points) {
  if (!points.empty()) series.push_back({.label = label, .look = look, .drawn = drawn, .points = points});
}

void Chart::Panel::add_power(const std::string& label, double c, double p) {
  auto [from, to] = x_range();
  if (p != 0 && c > 0) {  // the part of it that is inside
    const auto [least, most] = y_range();
    const double at_least = std::pow(least / c, 1 / p), at_most = std::pow(most / c, 1 / p);
    from = std::fmax(from, std::fmin(at_least, at_most));
    to = std::fmin(to, std::fmax(at_least, at_most));
  }
  if (!(from < to)) return;
  add(label, {}, Drawn::reference, {{from, c * std::pow(from, p)}, {to, c * std::pow(to, p)}});
}

std::string Chart::Panel::heading() const {
  std::string text = title;
  std::ranges::replace(text, '\n', ' ');
  return text;
}

bool Chart::Panel::has_cells() const {
  return std::ranges::any_of(series, [](const Series& s) { return s.drawn == Drawn::cells; });
}

bool Chart::Panel::has_place(const std::pair<double, double>& point) const {
  return std::isfinite(point.first) && std::isfinite(point.second) && (point.first > 0 || !x.is_log) &&
         (point.second > 0 || !y.is_log);
}

std::pair<double, double> Chart::Panel::range(const Axis& axis, bool is_x) const {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Series& s : series) {
    if (s.drawn == Drawn::reference || (s.drawn == Drawn::failed && !is_x)) continue;
    for (const auto& point : s.points) {
      const double value = is_x ? point.first : point.second;
      if (!std::isfinite(value) || (axis.is_log && !(value > 0))) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (s.drawn == Drawn::stems && !is_x) low = std::min(low, 0.0);
  }
  if (low > high) low = high = 1;
  constexpr double kMargin = 0.04, kNameMargin = 0.6;
  // The labels of an axis could not tell closer values apart: they are drawn as one value.
  constexpr double kSame = 1e-5;
  const bool is_one = high - low <= kSame * std::max(std::abs(low), std::abs(high));
  if (!axis.names.empty()) {
    low = -kNameMargin;
    high = static_cast<double>(axis.names.size()) - 1 + kNameMargin;
  } else if (axis.is_log) {
    const double margin = is_one ? 2 : std::pow(high / low, kMargin);
    low /= margin;
    high *= margin;
  } else {
    const double margin = is_one ? std::max(0.1, kMargin * std::abs(high)) : kMargin * (high - low);
    low -= margin;
    high += margin;
  }
  const double from = std::isfinite(axis.from) ? axis.from : low, to = std::isfinite(axis.to) ? axis.to : high;
  return {std::min(from, to), std::max(from, to)};
}

Chart::Panel& Chart::panel(const std::string& heading, const Axis& x, const Axis& y) {
  const auto known = std::ranges::find(panels, heading, &Panel::title);
  return known != panels.end() ? *known : panels.emplace_back(Panel{.title = heading, .x = x, .y = y});
}

}  // namespace ricochet
