#include <fmt/format.h>

#include "bench/studies/control/gradient_rows.h"
#include "reports/gnuplot.h"

namespace ricochet {

Figure draw_gradients(const FigureFolder& folder, const std::vector<ControlGradient>& gradients,
                      const std::string& name) {
  std::vector<const ControlGradient*> shown;  // the coarsest and the finest of each method
  for (std::size_t k = 0; k < gradients.size(); ++k) {
    const bool is_first = k == 0 || gradients[k - 1].method != gradients[k].method;
    const bool is_last = k + 1 == gradients.size() || gradients[k + 1].method != gradients[k].method;
    if (is_first || is_last) shown.push_back(&gradients[k]);
  }
  const auto& components = gradients.front().components;
  std::string data, panels;
  PlotCommand key;
  for (std::size_t c = 0; c < components.size(); ++c) {
    PlotCommand plot;
    for (std::size_t m = 0; m < shown.size(); ++m) {
      const ControlGradient& g = *shown[m];
      std::vector<std::pair<double, double>> points;
      for (std::size_t k = 0; k < g.derivatives[c].size(); ++k)
        points.emplace_back(static_cast<double>(k + 1), g.derivatives[c][k]);
      const std::string block_name = fmt::format("g{}_{}", c, m);
      data += data_block(block_name, points);
      const std::string label = g.is_reference() ? g.method : fmt::format("{}, {} steps", g.method, g.steps);
      const std::string style =
          g.is_reference() ? "with points pt 6 ps 1.1 lw 1.6 lc rgb '#000000'"
                           : fmt::format("with linespoints pt 7 ps 0.4 lw 1.4 lc rgb '{}'", curve_color(m - 1));
      plot.add(fmt::format("${} {}", block_name, style));
      if (c == 0) key.add(fmt::format("{}NaN {} title {}", m ? "" : "[0:1][0:1] ", style, gnuplot_text(label)));
    }
    panels += fmt::format("set ylabel 'd {}(T) / du'\n", components[c]) + plot.text();
  }
  const std::string script =
      gnuplot_head(1080, 760) + data + fmt::format("set output '{}.svg'\n", name) +
      fmt::format("set multiplot layout {},2 margins 0.1,0.98,0.08,0.94 spacing 0.11,0.1\n",
                  (components.size() + 1) / 2) +
      "set key off\nset xlabel 'control interval'\n" + panels +
      // One key for all panels, in a plot of its own above them.
      "set lmargin at screen 0.02\nset rmargin at screen 0.98\nset bmargin at screen 0.95\nset tmargin at screen 1\n"
      "unset border\nunset tics\nunset xlabel\nunset ylabel\n"
      "set key on center horizontal maxrows 1 reverse Left samplen 2 font ',12'\n" +
      key.text() + "unset multiplot\n";
  folder.draw(name, script);
  return {
      name + ".svg", "Derivatives of the terminal state",
      "Derivative of each component of the terminal state with respect to the control of each interval. FESD-J lies "
      "on the reference, time stepping does not, with any step length."};
}

}  // namespace ricochet
