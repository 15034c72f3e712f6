#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "bench/studies/grid/curve_style.h"
#include "bench/studies/grid/grid_tables.h"
#include "problems/input_error.h"
#include "reports/gnuplot.h"
#include "reports/order_fit.h"

namespace ricochet {
namespace {

constexpr double kLeastDrawn = 1e-16;  // that is drawn

struct Family {
  std::string name;
  std::vector<std::string> methods;
};

/// Methods with fixed steps, in the order of the results; those without a tableau are one family.
std::vector<Family> families_of(const GridResults& results) {
  std::vector<Family> families;
  for (const auto& method : results.methods()) {
    if (results.of(method).front()->setting.steps == 0) continue;
    const std::string name = curve_family(method);
    const auto known = std::ranges::find(families, name, &Family::name);
    if (known == families.end())
      families.push_back({name, {method}});
    else
      known->methods.push_back(method);
  }
  return families;
}

/// Ranges of both axes, which hold every run of a family.
struct OrderAxes {
  double finest = 0, coarsest = 0, low = 0, high = 0;
  bool has_errors = false;

  OrderAxes(const GridResults& results, const Family& family) {
    std::vector<double> steps, errors;
    for (const auto& method : family.methods) {
      for (const Run* run : results.of(method)) {
        steps.push_back(run->h_bar);
        if (run->has_error()) errors.push_back(std::max(run->error, kLeastDrawn));
      }
    }
    has_errors = !errors.empty();
    if (!has_errors) return;
    std::tie(low, high) = decades(errors);
    finest = std::ranges::min(steps);
    coarsest = std::ranges::max(steps);
  }
};

/// A line of the nominal order through the middle of the window of a fit.
Points nominal_slope(const std::vector<const Run*>& runs, const OrderFit& fit) {
  std::vector<const Run*> window;
  for (const Run* run : runs) {
    if (run->has_error() && run->setting.steps >= fit.first_steps && run->setting.steps <= fit.last_steps)
      window.push_back(run);
  }
  double x = 0, y = 0;
  for (const Run* run : window) {
    x += std::log10(run->h_bar) / static_cast<double>(window.size());
    y += std::log10(run->error) / static_cast<double>(window.size());
  }
  Points line;
  for (const Run* end : {window.front(), window.back()})
    line.emplace_back(end->h_bar, std::pow(10, y + runs.front()->nominal_order * (std::log10(end->h_bar) - x)));
  return line;
}

constexpr const char* kStepAxis = "step length h̄ = T / (N_sim N_FE)  [s]";

/// The curves of one method: runs, nominal order, what failed and what was run instead.
struct OrderCurves {
  CurveLook look;
  std::string label;
  Points solved, nominal, failed, replaced;

  OrderCurves(const GridResults& results, const std::string& method, const OrderAxes& axes)
      : look(curve_look(results, method)) {
    const auto runs = results.of(method);
    for (const Run* run : runs) {
      if (run->succeeded())
        solved.emplace_back(run->h_bar, std::max(run->error, kLeastDrawn));
      else
        failed.emplace_back(run->h_bar, axes.high);
    }
    for (const auto& other : results.records) {
      if (other.instead_of == method && other.has_error()) replaced.emplace_back(other.h_bar, other.error);
    }
    const ObservedOrder order = observe_order(runs);
    if (order.fit) nominal = nominal_slope(runs, *order.fit);
    label = curve_label(results, *runs.front()) +
            (order.fit ? fmt::format(", slope {:.2f} ± {:.2f}", order.fit->slope, order.fit->half_width)
                       : ", no order: " + order.no_fit);
  }
};

void add_order_curves(const GridResults& results, const std::string& method, const std::string& name,
                      const OrderAxes& axes, std::string& data, PlotCommand& plot) {
  const OrderCurves curves(results, method, axes);
  const std::string color = palette_colour(curves.look.colour);
  data += data_block(name, curves.solved);
  if (!curves.nominal.empty()) {
    data += data_block(name + "_slope", curves.nominal);
    plot.add(fmt::format("${}_slope with lines lc rgb '#{}' lw 1 dt 2 notitle", name, color));
  }
  plot.add(fmt::format("${} with linespoints {} lw 1.6 ps 0.55 title {}", name, curves.look.gnuplot(),
                       gnuplot_text(curves.label)));
  if (!curves.failed.empty()) {
    data += data_block(name + "_failed", curves.failed);
    plot.add(fmt::format("${}_failed with points lc rgb '#{}' pt 2 ps 1 lw 2 notitle", name, color));
  }
  if (!curves.replaced.empty()) {
    data += data_block(name + "_replaced", curves.replaced);
    plot.add(fmt::format("${}_replaced with points lc rgb '#{}' pt 6 ps 1 lw 1.6 notitle", name, color));
  }
}

/// The same as data: the label of a curve has its order, of what else belongs to it there is none.
CurvePanel order_panel(const GridResults& results, const Family& family, const OrderAxes& axes) {
  CurvePanel panel{.title = family_title(family.name), .x_label = kStepAxis, .y_label = results.error_measure().axis};
  for (const auto& method : family.methods) {
    const OrderCurves curves(results, method, axes);
    CurveLook dashed = curves.look;
    dashed.dash = 1;
    panel.curves.push_back({.label = curves.label, .look = curves.look, .points = curves.solved});
    panel.curves.push_back({.label = "", .look = dashed, .drawn = "lines", .points = curves.nominal});
    CurveLook cross = curves.look;
    cross.symbol = 4;
    panel.curves.push_back({.label = "", .look = cross, .drawn = "marks", .points = curves.failed});
  }
  return panel;
}

const std::string kOrderCaption =
    "Error over the mean length of a Runge-Kutta step. Dashed: the nominal order. Crosses on the upper frame: runs "
    "without a solution; open circles: the same runs with elements added as needed. ";

Figure draw_family(const FigureFolder& folder, const GridResults& results, const Family& family,
                   const OrderAxes& axes) {
  std::string data;
  PlotCommand plot;
  for (std::size_t k = 0; k < family.methods.size(); ++k)
    add_order_curves(results, family.methods[k], fmt::format("s{}", k), axes, data, plot);
  std::string file = results.id + "_order_" + family.name;
  std::ranges::replace_if(
      file, [](char c) { return c == ':' || c == ' '; }, '_');
  std::string script = gnuplot_head(640, 530 + 26 * static_cast<int>(family.methods.size()));  // room for the key
  script += data;
  script += fmt::format("set output '{}.svg'\n", file);
  script += fmt::format("set title '{}'\n", family_title(family.name));
  script += "set logscale xy\nset format x '10^{%L}'\nset format y '10^{%L}'\n";
  script += fmt::format("set xrange [{:.3g}:{:.3g}]\nset yrange [{:.3g}:{:.3g}]\n", axes.finest / 1.6,
                        axes.coarsest * 1.6, axes.low, axes.high);
  script += fmt::format("set xlabel '{}'\nset ylabel '{}'\n", kStepAxis, results.error_measure().axis);
  script += "set key outside below left vertical maxcols 1 reverse Left samplen 2 spacing 1.15\n";
  folder.draw(file, script + plot.text());
  return {file + ".svg", "Order: " + family.name, kOrderCaption + results.error_measure().definition};
}

}  // namespace

std::vector<Figure> draw_orders(const FigureFolder& folder, const GridResults& results) {
  std::vector<Figure> figures;
  for (const auto& family : families_of(results)) {
    const OrderAxes axes(results, family);
    if (axes.has_errors) figures.push_back(draw_family(folder, results, family, axes));
  }
  return figures;
}

Section::Chart order_chart(const GridResults& results) {
  std::vector<CurvePanel> panels;
  for (const auto& family : families_of(results)) {
    const OrderAxes axes(results, family);
    if (axes.has_errors) panels.push_back(order_panel(results, family, axes));
  }
  return {.kind = "curves",
          .name = "error_over_step",
          .table = "orders",
          .title = "Error over step length",
          .caption = kOrderCaption + results.error_measure().definition,
          .data = curves_data(panels),
          .still = {[=](const FigureFolder& folder) { return draw_orders(folder, results); }}};
}

Figure draw_work_precision(const FigureFolder& folder, const GridResults& results) {
  std::vector<double> errors;
  for (const auto& record : results.records) {
    const Timing* timing = results.timing_of(record);
    if (!record.has_error() || !timing || !record.instead_of.empty()) continue;
    errors.push_back(std::clamp(record.error, kLeastDrawn, kLargestError));
  }
  if (errors.empty()) throw InputError("work-precision figure", results.id, "no run of these results was timed");
  const auto [low, high] = decades(errors);
  KeyedPanels figure;
  figure.panel_width = 980;
  figure.panel_height = 600;
  std::string data;
  PlotCommand plot;
  for (const auto& method : results.methods()) {
    const CurveLook look = curve_look(results, method);
    Points points;
    for (const Run* run : results.of(method)) {
      const Timing* timing = results.timing_of(*run);
      if (run->has_error() && timing)
        points.emplace_back(std::clamp(run->error, kLeastDrawn, kLargestError), timing->median * 1e3);
    }
    if (points.empty()) continue;
    const std::string name = fmt::format("w{}", figure.key.size());
    const std::string drawn = fmt::format("with linespoints {} lw 1.6 ps 0.5", look.gnuplot());
    data += data_block(name, points);
    plot.add(fmt::format("${} {} notitle", name, drawn));
    figure.key.push_back({drawn, curve_label(results, *results.of(method).front())});
  }
  figure.panels = {data +
                   fmt::format("set logscale xy\nset format x '10^{{%L}}'\nset format y '10^{{%L}}'\n"
                               "set xrange [{:.3g}:{:.3g}]\nset xlabel '{}'\nset ylabel 'CPU time [ms]'\n",
                               low, high, results.error_measure().axis) +
                   plot.text()};
  const std::string file = results.id + "_work_precision";
  folder.draw(file, figure.script(file));
  return {file + ".svg", "Speed against error",
          "Median CPU time of a whole run over its error: down and left is better. Every point is one run with another "
          "step length or tolerance; errors above 10 are drawn there. " +
              results.error_measure().definition};
}

Figure draw_trajectory(const FigureFolder& folder, const Trajectory& trajectory, const std::string& name) {
  const std::size_t n_q = trajectory.q.empty() ? 0 : trajectory.q.front().size();
  std::string data;
  PlotCommand positions, velocities;
  for (std::size_t k = 0; k < n_q; ++k) {
    Points q, v;
    for (std::size_t s = 0; s < trajectory.t.size(); ++s) {
      q.emplace_back(trajectory.t[s], trajectory.q[s][k]);
      v.emplace_back(trajectory.t[s], trajectory.v[s][k]);
    }
    data += data_block(fmt::format("q{}", k), q) + data_block(fmt::format("v{}", k), v);
    const std::string& color = curve_color(k);
    positions.add(fmt::format("$q{} with lines lc rgb '{}' lw 1.8 title 'q[{}]'", k, color, k));
    velocities.add(fmt::format("$v{} with lines lc rgb '{}' lw 1.4 title 'v[{}]'", k, color, k));
  }
  std::string script = gnuplot_head(980, 560);
  script +=
      data + fmt::format("set output '{}.svg'\n", name) +
      fmt::format("set multiplot layout 2,1 title {} noenhanced\n",
                  gnuplot_text(fmt::format("{}, {} {}", trajectory.problem, trajectory.method, trajectory.setting))) +
      "set lmargin 9\nset key right top horizontal noenhanced\n";
  script += "set ylabel 'q [m, rad]'\nset format x ''\n" + positions.text();
  script +=
      "set ylabel 'v [m/s, rad/s]'\nset format x '%g'\nset xlabel 't [s]'\n" + velocities.text() + "unset multiplot\n";
  folder.draw(name, script);
  return {name + ".svg", "Motion",
          fmt::format("{} as {} {} computes it, between its steps as the method itself says. Velocities jump at "
                      "impacts.",
                      trajectory.problem, trajectory.method, trajectory.setting)};
}

}  // namespace ricochet
