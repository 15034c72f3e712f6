#include "reports/growth.h"

#include <fmt/format.h>
#include <gsl/gsl_fit.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reports/gnuplot.h"

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

std::string growth_script(const std::vector<GrowthCurve>& curves, const std::string& file, const std::string& x_label,
                          const std::string& y_label) {
  std::vector<std::string> panels, names;
  for (const auto& curve : curves) {
    if (std::ranges::find(panels, curve.panel) == panels.end()) panels.push_back(curve.panel);
    if (std::ranges::find(names, curve.name) == names.end()) names.push_back(curve.name);
  }
  const int columns = panels.size() > 1 ? 2 : 1, rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  std::string script = gnuplot_head(560 * columns, 470 * rows);
  script += fmt::format("set output '{}'\nset logscale xy\nset multiplot layout {},{}\n", file, rows, columns);
  script +=
      fmt::format("set xlabel '{}'\nset ylabel '{}'\nset key left top reverse Left samplen 1.5\n", x_label, y_label);
  for (const auto& panel : panels) {
    std::string plot;
    double x_min = 1e300, x_max = 0, y_min = 1e300;
    for (std::size_t k = 0; k < curves.size(); ++k) {
      const GrowthCurve& curve = curves[k];
      if (curve.panel != panel || curve.points.empty()) continue;
      const auto color =
          static_cast<std::size_t>(std::ranges::find(names, curve.name) - names.begin());  // the same in all panels
      script += data_block(fmt::format("curve{}", k), curve.points);
      plot += fmt::format("{}$curve{} with linespoints lc rgb '{}' lw 1.8 pt {} ps 0.7 title '{}'",
                          plot.empty() ? "" : ", ", k, curve_color(color), 4 + color, curve.name);
      for (const auto& [x, y] : curve.points) {
        x_min = std::min(x_min, x);
        x_max = std::max(x_max, x);
        y_min = std::min(y_min, y);
      }
    }
    if (plot.empty()) continue;
    script += data_block("slope", {{x_min, y_min / 2}, {x_max, y_min / 2 * x_max / x_min}});
    script +=
        fmt::format("set title '{}'\nplot {}, $slope with lines lc rgb '#999999' dt 2 title 'slope 1'\n", panel, plot);
  }
  return script + "unset multiplot\n";
}

}  // namespace ricochet
