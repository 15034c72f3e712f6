#include "reports/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "problems/input_error.h"
#include "reports/gnuplot.h"
#include "reports/order_fit.h"

namespace ricochet {
namespace {

/// "fesd:radau-iia:3,..." -> family "fesd:radau-iia", member "3"; "moreau_jean,theta=1" -> "moreau_jean,theta=1", "".
struct MethodName {
  std::string family, member;
};

MethodName take_apart(const std::string& method) {
  const std::string name = method.substr(0, method.find(','));
  const auto colon = name.rfind(':');
  if (colon == std::string::npos || name.find(':') == colon) return {method, ""};
  return {name.substr(0, colon), name.substr(colon + 1)};
}

struct Style {
  std::string color;
  int point;  // gnuplot's point type
  int dash;   // gnuplot's dash type
};

// Steps of one hue per family, dark for many stages, so that a family reads as one; colours after ColorBrewer
// (Blues, Oranges), which keep their order in print and for colour-blind readers.
const std::map<std::string, std::vector<std::string>>& ramps() {
  static const std::map<std::string, std::vector<std::string>> colors = {
      {"fesd:radau-iia", {"#9ecae1", "#6baed6", "#2171b5", "#08306b"}},
      {"fesd:gauss", {"#fdae6b", "#fd8d3c", "#d94801", "#7f2704"}},
      {"fesd_adaptive:radau-iia", {"#dadaeb", "#bcbddc", "#9e9ac8", "#807dba", "#6a51a3", "#3f007d"}},
      {"fesd_adaptive:gauss", {"#c7e9c0", "#a1d99b", "#74c476", "#41ab5d", "#238b45", "#00441b"}},
  };
  return colors;
}

/// Options behind the tableau, when another method of the results differs in nothing else.
std::string distinguishing_options(const Results& results, const std::string& method) {
  const auto [family, member] = take_apart(method);
  const auto all = results.methods();
  const auto twins = std::count_if(all.begin(), all.end(), [&](const std::string& other) {
    const auto name = take_apart(other);
    return !member.empty() && name.family == family && name.member == member;
  });
  const auto comma = method.find(',');
  return twins > 1 && comma != std::string::npos ? method.substr(comma + 1) : "";
}

/// A method keeps its colour in all figures of its results. Variants of a method are dashed.
Style style_of(const Results& results, const std::string& method) {
  static const std::vector<std::string> others = {"#525252", "#969696", "#ae017e", "#8c6d31", "#c994c7", "#02818a"};
  static const std::vector<int> points = {7, 5, 9, 13};
  const auto [family, member] = take_apart(method);
  const int dash = distinguishing_options(results, method).empty() ? 1 : 3;
  if (const auto ramp = ramps().find(family); ramp != ramps().end() && !member.empty()) {
    const auto k =
        std::clamp<std::size_t>(static_cast<std::size_t>(std::atoi(member.c_str())), 1, ramp->second.size()) - 1;
    return {ramp->second[k], points[k % points.size()], dash};
  }
  std::size_t index = 0;  // among the methods without a hue of their family
  for (const auto& other : results.methods()) {
    if (other == method) break;
    index += !ramps().contains(take_apart(other).family);
  }
  return {others[index % others.size()], points[index % points.size()], dash};
}

std::string family_title(const std::string& family) {
  static const std::map<std::string, std::string> names = {{"fesd:radau-iia", "FESD-J Radau IIA"},
                                                           {"fesd:gauss", "FESD-J Gauss"},
                                                           {"fesd_adaptive:radau-iia", "FESD-J adaptive Radau IIA"},
                                                           {"fesd_adaptive:gauss", "FESD-J adaptive Gauss"},
                                                           {"time stepping", "Time stepping"}};
  const auto known = names.find(family);
  return known != names.end() ? known->second : family;
}

/// "FESD-J Gauss 4", or the title that the method gives itself.
std::string label_of(const Results& results, const Record& record) {
  const auto [family, member] = take_apart(record.method);
  if (member.empty() || !ramps().contains(family)) return record.title;
  const std::string options = distinguishing_options(results, record.method);
  return family_title(family) + " " + member + (options.empty() ? "" : ", " + options);
}

}  // namespace

bool can_draw() {
  return std::system("gnuplot --version >/dev/null 2>&1") == 0;
}

FigureFolder::FigureFolder(std::string folder) : folder_(std::move(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw InputError("report folder", folder_, error.message());
}

void FigureFolder::write(const std::string& name, const std::string& text) const {
  const auto path = std::filesystem::path(folder_) / name;
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw InputError("figure", path.string(), "cannot be written");
}

void FigureFolder::draw(const std::string& name, const std::string& script) const {
  write(name + ".gp", script);
  const std::string command = fmt::format("cd '{}' && gnuplot '{}.gp' 2>'{}.log'", folder_, name, name);
  if (std::system(command.c_str()) != 0)
    throw InputError("figure", name, fmt::format("gnuplot failed, see {}/{}.log", folder_, name));
  std::filesystem::remove(std::filesystem::path(folder_) / (name + ".log"));
}

std::vector<Figure> FigureFolder::order(const Results& results) {
  std::vector<std::pair<std::string, std::vector<std::string>>> families;  // in the order of the results
  for (const auto& method : results.methods()) {
    if (results.of(method).front()->steps == 0) continue;
    const auto [family, member] = take_apart(method);
    const std::string key = member.empty() ? "time stepping" : family;
    const auto known = std::find_if(families.begin(), families.end(), [&](const auto& f) { return f.first == key; });
    if (known == families.end())
      families.push_back({key, {method}});
    else
      known->second.push_back(method);
  }

  std::vector<Figure> figures;
  for (const auto& [family, methods] : families) {
    std::vector<double> steps, errors;
    for (const auto& method : methods) {
      for (const Record* run : results.of(method)) {
        steps.push_back(run->h_bar);
        if (run->has_error()) errors.push_back(std::max(run->error, 1e-16));
      }
    }
    if (errors.empty()) continue;
    const auto [low, high] = decades(errors);
    std::string data, plot;
    const auto add = [&](const std::string& item) { plot += (plot.empty() ? "plot " : ", \\\n     ") + item; };
    std::size_t index = 0;
    for (const auto& method : methods) {
      const Style style = style_of(results, method);
      std::vector<std::pair<double, double>> solved, failed, replaced, slope;
      const auto runs = results.of(method);
      for (const Record* run : runs) {
        if (run->succeeded())
          solved.emplace_back(run->h_bar, std::max(run->error, 1e-16));
        else
          failed.emplace_back(run->h_bar, high);
      }
      for (const auto& other : results.records) {
        if (other.instead_of == method && other.has_error()) replaced.emplace_back(other.h_bar, other.error);
      }
      const std::string name = fmt::format("s{}", index);
      data += data_block(name, solved);
      const auto fit = fit_order(runs);
      if (fit) {  // a line of the nominal order through the middle of the window
        std::vector<const Record*> window;
        for (const Record* run : runs) {
          if (run->has_error() && run->steps >= fit->first_steps && run->steps <= fit->last_steps)
            window.push_back(run);
        }
        double x = 0, y = 0;
        for (const Record* run : window) {
          x += std::log10(run->h_bar) / static_cast<double>(window.size());
          y += std::log10(run->error) / static_cast<double>(window.size());
        }
        for (const Record* end : {window.front(), window.back()}) {
          slope.emplace_back(end->h_bar, std::pow(10, y + runs.front()->nominal_order * (std::log10(end->h_bar) - x)));
        }
        data += data_block(name + "_slope", slope);
        add(fmt::format("${}_slope with lines lc rgb '{}' lw 1 dt 2 notitle", name, style.color));
      }
      const std::string fitted =
          fit ? fmt::format(", slope {:.2f} ± {:.2f}", fit->slope, fit->half_width) : ", not asymptotic";
      add(fmt::format("${} with linespoints lc rgb '{}' lw 1.6 dt {} pt {} ps 0.55 title '{}{}'", name, style.color,
                      style.dash, style.point, label_of(results, *results.of(method).front()), fitted));
      if (!failed.empty()) {
        data += data_block(name + "_failed", failed);
        add(fmt::format("${}_failed with points lc rgb '{}' pt 2 ps 1 lw 2 notitle", name, style.color));
      }
      if (!replaced.empty()) {
        data += data_block(name + "_replaced", replaced);
        add(fmt::format("${}_replaced with points lc rgb '{}' pt 6 ps 1 lw 1.6 notitle", name, style.color));
      }
      ++index;
    }
    std::string file = results.experiment() + "_order_" + family;
    std::replace(file.begin(), file.end(), ':', '_');
    std::replace(file.begin(), file.end(), ' ', '_');
    std::string script = gnuplot_head(640, 530 + 26 * static_cast<int>(methods.size()));  // the key below needs room
    script += data;
    script += fmt::format("set output '{}.svg'\n", file);
    script += fmt::format("set title '{}'\n", family_title(family));
    script += "set logscale xy\nset format x '10^{%L}'\nset format y '10^{%L}'\n";
    const auto [finest, coarsest] = std::minmax_element(steps.begin(), steps.end());
    script += fmt::format("set xrange [{:.3g}:{:.3g}]\nset yrange [{:.3g}:{:.3g}]\n", *finest / 1.6, *coarsest * 1.6,
                          low, high);
    script += fmt::format("set xlabel 'step length h̄ = T / (N_sim N_FE)  [s]'\nset ylabel '{}'\n",
                          results.error_measure().axis);
    script += "set key outside below left vertical maxcols 1 reverse Left samplen 2 spacing 1.15\n";
    draw(file, script + plot + "\n");
    figures.push_back({file + ".svg", "Order: " + family,
                       "Error over the mean length of a Runge-Kutta step. Dashed: the nominal order. Crosses on the "
                       "upper frame: runs without a solution; open circles: the same runs with elements added as "
                       "needed. " +
                           results.error_measure().definition});
  }
  return figures;
}

Figure FigureFolder::work_precision(const Results& results) {
  std::vector<double> errors, times;
  for (const auto& record : results.records) {
    if (!record.has_error() || !record.timing || !record.instead_of.empty()) continue;
    errors.push_back(std::max(record.error, 1e-16));
    times.push_back(record.timing->median * 1e3);
  }
  if (errors.empty())
    throw InputError("work-precision figure", results.experiment(), "no run of these results was timed");
  const auto [low, high] = decades(errors);
  std::string data, plot;
  std::size_t index = 0;
  for (const auto& method : results.methods()) {
    const Style style = style_of(results, method);
    std::vector<std::pair<double, double>> points;
    for (const Record* run : results.of(method)) {
      if (run->has_error() && run->timing) points.emplace_back(std::max(run->error, 1e-16), run->timing->median * 1e3);
    }
    if (!points.empty()) {
      const std::string name = fmt::format("w{}", index);
      data += data_block(name, points);
      plot += fmt::format("{}${} with linespoints lc rgb '{}' lw 1.6 dt {} pt {} ps 0.5 title '{}'",
                          plot.empty() ? "plot " : ", \\\n     ", name, style.color, style.dash, style.point,
                          label_of(results, *results.of(method).front()));
    }
    ++index;
  }
  std::string script = gnuplot_head(980, 620);
  script += data;
  const std::string file = results.experiment() + "_work_precision";
  script += fmt::format("set output '{}.svg'\n", file);
  script += "set logscale xy\nset format x '10^{%L}'\nset format y '10^{%L}'\n";
  script += fmt::format("set xrange [{:.3g}:{:.3g}]\n", low, high);
  script += fmt::format(
      "set xlabel '{}'\nset ylabel 'CPU time [ms]'\nset key outside right center reverse Left samplen 2 spacing 1.2\n",
      results.error_measure().axis);
  draw(file, script + plot + "\n");
  return {file + ".svg", "Speed against error",
          "Median CPU time of a whole run over its error: down and left is better. Every point is one run with another "
          "step length or tolerance. " +
              results.error_measure().definition};
}

Figure FigureFolder::trajectory(const Trajectory& trajectory, const std::string& name) {
  const std::size_t n_q = trajectory.q.empty() ? 0 : trajectory.q.front().size();
  std::string data, positions, velocities;
  for (std::size_t k = 0; k < n_q; ++k) {
    std::vector<std::pair<double, double>> q, v;
    for (std::size_t s = 0; s < trajectory.t.size(); ++s) {
      q.emplace_back(trajectory.t[s], trajectory.q[s][k]);
      v.emplace_back(trajectory.t[s], trajectory.v[s][k]);
    }
    data += data_block(fmt::format("q{}", k), q) + data_block(fmt::format("v{}", k), v);
    const std::string& color = curve_color(k);
    positions += fmt::format("{}$q{} with lines lc rgb '{}' lw 1.8 title 'q_{}'", k ? ", " : "plot ", k, color, k + 1);
    velocities += fmt::format("{}$v{} with lines lc rgb '{}' lw 1.4 title 'v_{}'", k ? ", " : "plot ", k, color, k + 1);
  }
  std::string script = gnuplot_head(980, 560);
  script += data + fmt::format("set output '{}.svg'\n", name) +
            "set multiplot layout 2,1\nset lmargin 9\nset key right top horizontal\n";
  script += "set ylabel 'position'\nset format x ''\n" + positions + "\n";
  script += "set ylabel 'velocity'\nset format x '%g'\nset xlabel 't [s]'\n" + velocities + "\nunset multiplot\n";
  draw(name, script);
  return {name + ".svg", "Motion",
          fmt::format("{} as {} computes it. Velocities jump at impacts.", trajectory.problem, trajectory.method)};
}

Figure FigureFolder::growth(const std::vector<GrowthCurve>& curves, const std::string& name, const std::string& title,
                            const std::string& x_label, const std::string& y_label) {
  draw(name, growth_script(curves, name + ".svg", x_label, y_label));
  return {name + ".svg", title, fmt::format("{} over {}.", title, x_label)};
}

}  // namespace ricochet
