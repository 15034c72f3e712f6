#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

#include "reports/figures.h"
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

/// Of "fesd:radau-iia:3,elements=as_needed": the tableau and its options.
std::pair<std::string, std::string> parts_of(const std::string& method) {
  const auto comma = method.find(',');
  const std::string name = method.substr(0, comma);
  return {name.substr(std::min(name.find(':') + 1, name.size())),
          comma == std::string::npos ? "" : method.substr(comma + 1)};
}

int stages_of(const std::string& tableau) {
  return std::atoi(tableau.substr(tableau.rfind(':') + 1).c_str());
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
  for (const auto& c : captures) families[c.tableau.substr(0, c.tableau.find(':'))].emplace_back(c.n_s, c.kappa);
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

}  // namespace

std::vector<Figure> FigureFolder::zeno(const std::vector<ZenoCapture>& captures, const std::vector<ZenoRun>& runs,
                                       const std::string& name) {
  std::vector<std::string> tableaus;  // with fixed steps, in the order of the runs
  std::map<std::string, std::vector<const ZenoRun*>> fixed, as_needed;
  std::vector<double> lengths;
  for (const auto& run : runs) {
    if (run.H == 0) continue;
    const auto [tableau, options] = parts_of(run.method);
    lengths.push_back(run.H);
    if (options == "elements=as_needed")
      as_needed[tableau].push_back(&run);
    else if (options.empty())
      fixed[tableau].push_back(&run);
    if (std::find(tableaus.begin(), tableaus.end(), tableau) == tableaus.end()) tableaus.push_back(tableau);
  }
  if (lengths.empty()) return {};
  const auto [finest, coarsest] = std::minmax_element(lengths.begin(), lengths.end());
  const std::string x_axis = fmt::format(
      "set logscale xy\nset format x '10^{{%L}}'\nset format y '10^{{%L}}'\nset xrange [{:.3g}:{:.3g}]\n"
      "set xlabel 'step H  [s]'\nset key off\n",
      *finest / 1.6, *coarsest * 1.6);
  const auto panels = [&](const std::string& family, double (*value)(const ZenoRun&), double least, bool has_bound,
                          const std::string& axis, std::string& data) {
    std::string text = x_axis + axis;
    for (const auto& tableau : tableaus) {
      if (!tableau.starts_with(family)) continue;
      std::string id = tableau;
      std::replace_if(
          id.begin(), id.end(), [](char c) { return c == ':' || c == '-'; }, '_');
      PlotCommand plot;
      add_points(id, fixed[tableau], false, value, least, data, plot);
      add_points(id, as_needed[tableau], true, value, least, data, plot);
      Points bound, infeasible;
      for (const auto* list : {&fixed[tableau], &as_needed[tableau]}) {
        for (const ZenoRun* run : *list) {
          if (run->has_bound()) bound.emplace_back(run->H, run->rest_bound * (1 - run->e));
        }
      }
      for (const ZenoRun* run : fixed[tableau]) {
        if (!run->succeeded()) infeasible.emplace_back(run->H, 2.5 * least);
      }
      std::sort(bound.begin(), bound.end());
      if (has_bound && !bound.empty()) {
        data += data_block(id + "_bound", bound);
        plot.add(fmt::format("${}_bound with lines lw 1.6 lc rgb '#d94801' notitle", id));
      }
      if (!infeasible.empty()) {
        data += data_block(id + "_none", infeasible);
        plot.add(fmt::format("${}_none with points pt 2 ps 0.5 lc rgb '#969696' notitle", id));
      }
      text += fmt::format("set title '{}, {} stage{}'\n", family == "gauss" ? "Gauss" : "Radau IIA", stages_of(tableau),
                          stages_of(tableau) > 1 ? "s" : "") +
              plot.text();
    }
    return text;
  };

  std::string data;
  const std::string rest = panels("radau-iia", scaled_rest_error, 1e-10, true,
                                  "set ylabel '|t_Z - t_{rest}| (1 - e)  [s]' enhanced\nset yrange [1e-10:1]\n", data);
  const std::string kappa = kappa_panel(captures, data);
  const auto multiplot = [&](const std::string& file, int rows, int columns, int width, int height,
                             const std::string& blocks, const std::string& text, const std::string& key) {
    draw(file,
         gnuplot_head(width, height) + blocks + fmt::format("set output '{}.svg'\n", file) +
             fmt::format("set multiplot layout {},{} margins 0.08,0.98,0.1,0.87 spacing 0.09,0.17\n", rows, columns) +
             text + key + "unset multiplot\n");
  };
  const std::string marks =
      ", NaN with points pt 6 ps 0.6 lc rgb '#225ea8' title 'elements added', NaN with points pt 2 ps 0.6 lc rgb "
      "'#969696' title 'no solution'";
  multiplot(name + "_rest_time", 2, 3, 1080, 720, data, rest + kappa,
            key_of_restitution(runs, marks + ", NaN with lines lw 1.6 lc rgb '#d94801' title 'bound'"));
  data.clear();
  const std::string left =
      panels("gauss", velocity_left, 1e-19, false, "set ylabel '|v(T)|  [m/s]'\nset yrange [1e-19:10]\n", data);
  multiplot(name + "_gauss", 2, 2, 880, 720, data, left, key_of_restitution(runs, marks));
  return {
      {name + "_rest_time.svg", "Rest time of a bouncing ball",
       "How much too early FESD-J calls a bouncing ball at rest, times 1 - e, for all e together. The bound is 2 H / "
       "max(2, κ): the next flight did not fit into the element, and the closed element is long enough for its "
       "stage forces to be positive. Open circles: elements are added where two have no solution; these lie below "
       "the others, or on them. Crosses at the lower frame: no solution with two elements. For one stage, whose "
       "flights are not exact, there is no bound. Last panel: κ."},
      {name + "_gauss.svg", "Velocity that Gauss tableaus leave",
       "The velocity at the end of a ball that Gauss tableaus hold on the ground. An even number of stages gives "
       "back v⁺ at the end of every element, for ever; an odd number -v⁺, which an impact then multiplies by -e. "
       "Crosses at the lower frame: no solution with two elements."}};
}

}  // namespace ricochet
