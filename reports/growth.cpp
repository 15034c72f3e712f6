#include "reports/growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reports/gnuplot.h"

namespace ricochet {

double growth_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  if (n < 3) return std::numeric_limits<double>::quiet_NaN();
  double X = 0, Y = 0, XX = 0, XY = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double a = std::log(x[i]), b = std::log(y[i]);
    X += a / n;
    Y += b / n;
    XX += a * a / n;
    XY += a * b / n;
  }
  return (XY - X * Y) / (XX - X * X);
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
