#include "reports/growth.h"

#include <fmt/format.h>
#include <gsl/gsl_fit.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reports/curve_look.h"
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

Figure draw_growth(const FigureFolder& folder, const std::vector<GrowthCurve>& curves, const std::string& file_name,
                   const std::string& title, const std::string& x_label, const std::string& y_label) {
  std::vector<std::string> panels, names;
  for (const auto& curve : curves) {
    if (std::ranges::find(panels, curve.panel) == panels.end()) panels.push_back(curve.panel);
    if (std::ranges::find(names, curve.name) == names.end()) names.push_back(curve.name);
  }
  KeyedPanels figure;
  figure.columns = panels.size() > 4 ? 3 : 2;
  const auto style = [&](const std::string& name) {  // the same in all panels
    const auto k = static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
    return fmt::format("with linespoints {} lw 1.8 ps 0.7", CurveLook::of(k).gnuplot());
  };
  for (std::size_t p = 0; p < panels.size(); ++p) {
    std::string script = fmt::format("set title {} noenhanced\nset logscale xy\nset xlabel '{}'\nset ylabel '{}'\n",
                                     gnuplot_text(panels[p]), x_label, y_label);
    PlotCommand plot;
    double x_min = 1e300, x_max = 0, y_min = 1e300;
    for (std::size_t k = 0; k < curves.size(); ++k) {
      const GrowthCurve& curve = curves[k];
      if (curve.panel != panels[p] || curve.points.empty()) continue;
      script += data_block(fmt::format("curve{}", k), curve.points);
      plot.add(fmt::format("$curve{} {} notitle", k, style(curve.name)));
      for (const auto& [x, y] : curve.points) {
        x_min = std::min(x_min, x);
        x_max = std::max(x_max, x);
        y_min = std::min(y_min, y);
      }
    }
    if (plot.is_empty()) continue;
    const std::string slope = fmt::format("slope{}", p);
    script += data_block(slope, {{x_min, y_min / 2}, {x_max, y_min / 2 * x_max / x_min}});
    plot.add(fmt::format("${} with lines lc rgb '#999999' dt 2 notitle", slope));
    figure.panels.push_back(script + plot.text());
  }
  for (const auto& name : names) figure.key.push_back({style(name), name});
  figure.key.push_back({"with lines lc rgb '#999999' dt 2", "slope 1"});
  folder.draw(file_name, figure.script(file_name));
  return {file_name + ".svg", title, fmt::format("{} over {}.", title, x_label)};
}

Section::Chart growth_chart(const std::vector<GrowthCurve>& curves, const std::string& file_name,
                            const std::string& title, const std::string& x_label, const std::string& y_label,
                            const std::string& table) {
  std::vector<CurvePanel> panels;
  std::vector<std::string> names;
  for (const auto& curve : curves) {
    auto panel = std::ranges::find(panels, curve.panel, &CurvePanel::title);
    if (panel == panels.end())
      panel = panels.insert(panels.end(), {.title = curve.panel, .x_label = x_label, .y_label = y_label});
    auto name = std::ranges::find(names, curve.name);
    if (name == names.end()) name = names.insert(names.end(), curve.name);
    panel->curves.push_back({.label = curve.name,
                             .look = CurveLook::of(static_cast<std::size_t>(name - names.begin())),
                             .points = curve.points});
  }
  return {.kind = "curves",
          .name = "growth",
          .table = table,
          .title = title,
          .caption = fmt::format("{} over {}.", title, x_label),
          .data = curves_data(panels),
          .still = {[=](const FigureFolder& folder) {
            return std::vector{draw_growth(folder, curves, file_name, title, x_label, y_label)};
          }}};
}

}  // namespace ricochet
