#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bench/studies/zeno/zeno_rows.h"
#include "methods/method_spec.h"
#include "reports/curve_look.h"
#include "reports/gnuplot.h"

namespace ricochet {
namespace {

using Points = std::vector<std::pair<double, double>>;

/// One hue from light to dark as e grows, after ColorBrewer (YlGnBu).
std::string color_of(double e) {
  static const std::vector<std::string> colors = {"#a1dab4", "#7fcdbb", "#41b6c4", "#1d91c0",
                                                  "#225ea8", "#253494", "#081d58"};
  return colors[std::min<std::size_t>(static_cast<std::size_t>(e * 7), 6)];
}

/// "radau-iia" and 3 of "radau-iia:3".
std::pair<std::string, int> family_and_stages(const std::string& tableau) {
  const auto colon = tableau.find(':');
  return {tableau.substr(0, colon), std::atoi(tableau.substr(colon + 1).c_str())};
}

/// Measured points by e, as filled circles, or open ones where elements are added.
void add_points(const std::string& id, const std::vector<const ZenoRun*>& runs, bool is_open,
                double (*value)(const ZenoRun&), double least, std::string& data, PlotCommand& plot) {
  std::map<double, Points> by_e;
  for (const ZenoRun* run : runs) {
    if (run->succeeded() && run->rests) by_e[run->e].emplace_back(run->H, std::max(value(*run), least));
  }
  for (const auto& [e, points] : by_e) {
    const std::string name = fmt::format("{}_{}_{:.0f}", id, is_open ? "o" : "f", 100 * e);
    data += data_block(name, points);
    plot.add(fmt::format("${} with points pt {} ps {} lw 1 lc rgb '{}' notitle", name, is_open ? 6 : 7,
                         is_open ? 0.45 : 0.4, color_of(e)));
  }
}

double scaled_rest_error(const ZenoRun& run) {
  return std::abs(run.rest_error()) * (1 - run.e);
}
double velocity_left(const ZenoRun& run) {
  return run.v_end;
}

/// One key for all panels, in a plot of its own above them.
std::string key_of_restitution(const std::vector<ZenoRun>& runs, const std::string& others) {
  std::set<double> values;
  for (const auto& run : runs) values.insert(run.e);
  PlotCommand key;
  for (const double e : values)
    key.add(fmt::format("{}NaN with points pt 7 ps 0.6 lc rgb '{}' title 'e = {}'",
                        e == *values.begin() ? "[0:1][0:1] " : "", color_of(e), e));
  return "unset logscale\nset lmargin at screen 0.02\nset rmargin at screen 0.98\nset bmargin at screen 0.93\n"
         "set tmargin at screen 1\nunset border\nunset tics\nunset xlabel\nunset ylabel\nunset title\nunset grid\n"
         "set key on center horizontal maxrows 2 reverse Left samplen 1 font ',12'\n" +
         key.text().substr(0, key.text().size() - 1) + others + "\n";
}

/// kappa over the number of stages.
std::string kappa_panel(const std::vector<ZenoCapture>& captures, std::string& data) {
  std::map<std::string, Points> families;
  for (const auto& c : captures) families[family_and_stages(c.tableau).first].emplace_back(c.n_s, c.kappa);
  PlotCommand plot;
  std::size_t index = 0;
  for (const auto& [family, points] : families) {
    const std::string name = fmt::format("kappa{}", index);
    data += data_block(name, points);
    plot.add(fmt::format("${} with linespoints pt 7 ps 0.6 lw 1.4 lc rgb '{}' title '{}'", name, curve_color(index++),
                         family));
  }
  plot.add("[1:9] 0.4317 * x**2 with lines dt 2 lc rgb '#000000' title '0.432 n_s^2'");
  return "set title 'shortest closed element, h = κ v⁺/g'\nset xlabel 'stages n_s'\nset ylabel 'κ'\nset logscale xy\n"
         "set xrange [0.9:10]\nset yrange [0.7:60]\nset format x '%g'\nset format y '%g'\nset xtics "
         "(1,2,3,4,5,6,7,8,9)\n"
         "set key on top left reverse Left samplen 1.5 font ',11'\n" +
         plot.text();
}

/// The runs with fixed steps, by tableau: with two elements a step, and with more where these have no solution.
struct ByTableau {
  std::vector<std::string> tableaus;  ///< in the order of the runs
  std::map<std::string, std::vector<const ZenoRun*>> fixed, as_needed;
  double finest = 0, coarsest = 0;  ///< step lengths [s]

  explicit ByTableau(const std::vector<ZenoRun>& runs) {
    for (const auto& run : runs) {
      if (run.H == 0) continue;
      const std::string tableau = tableau_of(run.method);
      if (std::ranges::find(tableaus, tableau) == tableaus.end()) tableaus.push_back(tableau);
      finest = finest == 0 ? run.H : std::min(finest, run.H);
      coarsest = std::max(coarsest, run.H);
      const bool adds = MethodSpec(run.method).choice("elements", {"fixed", "as_needed"}) == "as_needed";
      (adds ? as_needed : fixed)[tableau].push_back(&run);
    }
  }
};

/// What the panels of one figure have in common.
struct PanelStyle {
  std::string family;
  double (*value)(const ZenoRun&);
  double least;  ///< of the axis
  bool has_bound;
  std::string axis;
};

void add_bound(const std::string& id, const std::vector<const ZenoRun*>& runs, std::string& data, PlotCommand& plot) {
  Points bound;
  for (const ZenoRun* run : runs) {
    if (run->has_bound()) bound.emplace_back(run->H, run->rest_bound * (1 - run->e));
  }
  if (bound.empty()) return;
  std::ranges::sort(bound);
  data += data_block(id + "_bound", bound);
  plot.add(fmt::format("${}_bound with lines lw 1.6 lc rgb '#d94801' notitle", id));
}

void add_infeasible(const std::string& id, const std::vector<const ZenoRun*>& runs, double height, std::string& data,
                    PlotCommand& plot) {
  Points infeasible;
  for (const ZenoRun* run : runs) {
    if (!run->succeeded()) infeasible.emplace_back(run->H, height);
  }
  if (infeasible.empty()) return;
  data += data_block(id + "_none", infeasible);
  plot.add(fmt::format("${}_none with points pt 2 ps 0.5 lc rgb '#969696' notitle", id));
}

std::string tableau_panel(const std::string& tableau, ByTableau& runs, const PanelStyle& style, std::string& data) {
  std::string id = tableau;
  std::ranges::replace_if(
      id, [](char c) { return c == ':' || c == '-'; }, '_');
  const auto &fixed = runs.fixed[tableau], &as_needed = runs.as_needed[tableau];
  PlotCommand plot;
  add_points(id, fixed, false, style.value, style.least, data, plot);
  add_points(id, as_needed, true, style.value, style.least, data, plot);
  if (style.has_bound) {
    std::vector<const ZenoRun*> both = fixed;
    both.insert(both.end(), as_needed.begin(), as_needed.end());
    add_bound(id, both, data, plot);
  }
  add_infeasible(id, fixed, 2.5 * style.least, data, plot);
  const int stages = family_and_stages(tableau).second;
  return fmt::format("set title '{}, {} stage{}'\n", style.family == "gauss" ? "Gauss" : "Radau IIA", stages,
                     stages > 1 ? "s" : "") +
         plot.text();
}

/// The panels of a family, one per tableau.
std::string family_panels(ByTableau& runs, const PanelStyle& style, std::string& data) {
  std::string text = fmt::format(
      "set logscale xy\nset format x '10^{{%L}}'\nset format y '10^{{%L}}'\nset xrange [{:.3g}:{:.3g}]\n"
      "set xlabel 'step H  [s]'\nset key off\n{}",
      runs.finest / 1.6, runs.coarsest * 1.6, style.axis);
  for (const auto& tableau : runs.tableaus) {
    if (family_and_stages(tableau).first == style.family) text += tableau_panel(tableau, runs, style, data);
  }
  return text;
}

/// A page of panels with a key above them.
void draw_panels(const FigureFolder& folder, const std::string& file, const std::string& layout, int width, int height,
                 const std::string& data, const std::string& panels) {
  folder.draw(file, gnuplot_head(width, height) + data + fmt::format("set output '{}.svg'\n", file) +
                        fmt::format("set multiplot layout {} margins 0.08,0.98,0.1,0.87 spacing 0.09,0.17\n", layout) +
                        panels + "unset multiplot\n");
}

const char* const kMarks =
    ", NaN with points pt 6 ps 0.6 lc rgb '#225ea8' title 'elements added', NaN with points pt 2 ps 0.6 lc rgb "
    "'#969696' title 'no solution'";

Figure draw_rest_time(const FigureFolder& folder, const std::vector<ZenoCapture>& captures,
                      const std::vector<ZenoRun>& runs, ByTableau& by_tableau, const std::string& file) {
  std::string data;
  const std::string panels =
      family_panels(by_tableau,
                    {"radau-iia", scaled_rest_error, 1e-10, true,
                     "set ylabel '|t_Z - t_{rest}| (1 - e)  [s]' enhanced\nset yrange [1e-10:1]\n"},
                    data);
  const std::string kappa = kappa_panel(captures, data);
  const std::string key =
      key_of_restitution(runs, std::string(kMarks) + ", NaN with lines lw 1.6 lc rgb '#d94801' title 'bound'");
  draw_panels(folder, file, "2,3", 1080, 720, data, panels + kappa + key);
  return {
      file + ".svg", "Rest time of a bouncing ball",
      "How much too early FESD-J calls a bouncing ball at rest, times 1 - e, for all e together. The bound is 2 H / "
      "max(2, κ): the next flight did not fit into the element, and the closed element is long enough for its "
      "stage forces to be positive. Open circles: elements are added where two have no solution; these lie below "
      "the others, or on them. Crosses at the lower frame: no solution with two elements. For one stage, whose "
      "flights are not exact, there is no bound. Last panel: κ."};
}

Figure draw_velocity_left(const FigureFolder& folder, const std::vector<ZenoRun>& runs, ByTableau& by_tableau,
                          const std::string& file) {
  std::string data;
  const std::string panels = family_panels(
      by_tableau, {"gauss", velocity_left, 1e-19, false, "set ylabel '|v(T)|  [m/s]'\nset yrange [1e-19:10]\n"}, data);
  draw_panels(folder, file, "2,2", 880, 720, data, panels + key_of_restitution(runs, kMarks));
  return {file + ".svg", "Velocity that Gauss tableaus leave",
          "The velocity at the end of a ball that Gauss tableaus hold on the ground. An even number of stages gives "
          "back v⁺ at the end of every element, for ever; an odd number -v⁺, which an impact then multiplies by -e. "
          "Crosses at the lower frame: no solution with two elements."};
}

}  // namespace

std::vector<Figure> zeno_figures(const FigureFolder& folder, const std::vector<ZenoCapture>& captures,
                                 const std::vector<ZenoRun>& runs, const std::string& name) {
  ByTableau by_tableau(runs);
  if (by_tableau.tableaus.empty()) return {};
  return {draw_rest_time(folder, captures, runs, by_tableau, name + "_rest_time"),
          draw_velocity_left(folder, runs, by_tableau, name + "_gauss")};
}

Section::Chart zeno_chart(const std::vector<ZenoCapture>& captures, const std::vector<ZenoRun>& runs,
                          const std::string& name) {
  ByTableau by_tableau(runs);
  std::vector<CurvePanel> panels;
  for (const auto& tableau : by_tableau.tableaus) {
    const bool is_gauss = family_and_stages(tableau).first == "gauss";
    CurvePanel panel{.title = tableau,
                     .x_label = "step H [s]",
                     .y_label = is_gauss ? "|v(T)| [m/s]" : "(1 - e) times what t_rest is too early [s]"};
    std::map<double, Points> by_e;
    Points bound;
    for (const ZenoRun* run : by_tableau.fixed[tableau]) {
      if (run->succeeded() && run->rests)
        by_e[run->e].emplace_back(run->H, std::max(is_gauss ? velocity_left(*run) : scaled_rest_error(*run), 1e-19));
      if (!is_gauss && run->has_bound()) bound.emplace_back(run->H, run->rest_bound * (1 - run->e));
    }
    std::size_t k = 0;
    for (const auto& [e, points] : by_e)
      panel.curves.push_back(
          {.label = fmt::format("e = {}", e), .look = CurveLook::of(k++), .drawn = "marks", .points = points});
    std::ranges::sort(bound);
    panel.curves.push_back({.label = "bound", .look = CurveLook::of(k), .drawn = "lines", .points = bound});
    panels.push_back(panel);
  }
  return {.kind = "curves",
          .name = "rest",
          .table = "methods",
          .title = "How early a ball is called at rest, and what Gauss tableaus leave of its velocity",
          .caption = "Of steps with two elements, for all coefficients of restitution e together.",
          .data = curves_data(panels),
          .still = {[=](const FigureFolder& folder) { return zeno_figures(folder, captures, runs, name); }}};
}

}  // namespace ricochet
