#include "reports/growth.h"

#include <fmt/format.h>
#include <gsl/gsl_fit.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ricochet {

double growth_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() < 3) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> log_x, log_y;
  for (const double value : x) log_x.push_back(std::log(value));
  for (const double value : y) log_y.push_back(std::log(value));
  double intercept = 0, slope = 0, c00 = 0, c01 = 0, c11 = 0, squares = 0;
  gsl_fit_linear(log_x.data(), 1, log_y.data(), 1, log_x.size(), &intercept, &slope, &c00, &c01, &c11, &squares);
  return slope;
}

std::string growth_text(const std::string& n, const std::vector<double>& x, const std::vector<double>& y) {
  const double p = growth_exponent(x, y);
  return std::isfinite(p) ? fmt::format("{}^{:.2f}", n, p) : "-";
}

Chart growth_chart(const std::vector<GrowthCurve>& curves, const std::string& file, const std::string& title,
                   const std::string& x_label, const std::string& y_label) {
  Chart chart{.name = "growth", .file = file, .title = title, .caption = fmt::format("{} over {}.", title, x_label)};
  std::vector<std::string> names;
  for (const auto& curve : curves) {
    auto name = std::ranges::find(names, curve.name);
    if (name == names.end()) name = names.insert(names.end(), curve.name);
    chart.panel(curve.panel, {.label = x_label, .is_log = true}, {.label = y_label, .is_log = true})
        .add(curve.name, CurveLook::of(static_cast<std::size_t>(name - names.begin())), Chart::Drawn::both,
             curve.points);
  }
  std::erase_if(chart.panels, [](const Chart::Panel& panel) { return panel.series.empty(); });
  for (auto& panel : chart.panels) {
    double x = HUGE_VAL, y = HUGE_VAL;
    for (const auto& series : panel.series) {
      for (const auto& point : series.points) {
        x = std::min(x, point.first);
        y = std::min(y, point.second);
      }
    }
    panel.add_power("slope 1", 0.5 * y / x, 1);  // below all curves
  }
  chart.columns = chart.panels.size() > 4 ? 3 : 2;
  return chart;
}

}  // namespace ricochet
