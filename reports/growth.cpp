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
  // Many names would cover the curves: they get a cell of their own.
  const bool is_key_inside = names.size() <= 2;
  const int cells = static_cast<int>(panels.size()) + (is_key_inside ? 0 : 1);
  const int columns = cells > 4 ? 3 : std::min(cells, 2), rows = (cells + columns - 1) / columns;
  std::string script = gnuplot_head(490 * columns, 420 * rows);
  script += fmt::format("set output '{}'\nset logscale xy\nset multiplot layout {},{}\n", file, rows, columns);
  script += fmt::format("set xlabel '{}'\nset ylabel '{}'\n", x_label, y_label);
  script += is_key_inside ? "set key left top reverse Left samplen 1.5\n" : "unset key\n";
  const auto style = [&](const std::string& name) {  // the same in all panels
    const auto k = static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
    return fmt::format("with linespoints lc rgb '{}' lw 1.8 pt {} ps 0.7 title {}", curve_color(k), 4 + k,
                       gnuplot_text(name));
  };
  for (const auto& panel : panels) {
    PlotCommand plot;
    double x_min = 1e300, x_max = 0, y_min = 1e300;
    for (std::size_t k = 0; k < curves.size(); ++k) {
      const GrowthCurve& curve = curves[k];
      if (curve.panel != panel || curve.points.empty()) continue;
      script += data_block(fmt::format("curve{}", k), curve.points);
      plot.add(fmt::format("$curve{} {}", k, style(curve.name)));
      for (const auto& [x, y] : curve.points) {
        x_min = std::min(x_min, x);
        x_max = std::max(x_max, x);
        y_min = std::min(y_min, y);
      }
    }
    if (plot.is_empty()) continue;
    script += data_block("slope", {{x_min, y_min / 2}, {x_max, y_min / 2 * x_max / x_min}});
    plot.add("$slope with lines lc rgb '#999999' dt 2 title 'slope 1'");
    script += fmt::format("set title {}\n{}", gnuplot_text(panel), plot.text());
  }
  if (!is_key_inside) {
    script += "unset title\nunset xlabel\nunset ylabel\nunset border\nunset tics\nunset grid\n";
    script += "set key center center reverse Left samplen 2.5 spacing 1.3\nset xrange [1:10]\nset yrange [1:10]\n";
    PlotCommand key;
    for (const auto& name : names) key.add(fmt::format("NaN {}", style(name)));
    key.add("NaN with lines lc rgb '#999999' dt 2 title 'slope 1'");
    script += key.text();
  }
  return script + "unset multiplot\n";
}

Figure draw_growth(const FigureFolder& folder, const std::vector<GrowthCurve>& curves, const std::string& name,
                   const std::string& title, const std::string& x_label, const std::string& y_label) {
  folder.draw(name, growth_script(curves, name + ".svg", x_label, y_label));
  return {name + ".svg", title, fmt::format("{} over {}.", title, x_label)};
}

}  // namespace ricochet
