#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reports/figures.h"
#include "reports/gnuplot.h"
#include "reports/motion_picture.h"

namespace ricochet {
namespace {

using Points = std::vector<std::pair<double, double>>;

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
// A velocity that changes by less of the range of all velocities at one instant does not jump.
constexpr double kJump = 1e-3;

/// "plot ..." of one panel.
class Panel {
 public:
  explicit Panel(std::string id) : id_(std::move(id)) {}

  /// @param style  of the data; empty title: not in the key
  void add(const Points& points, std::size_t color, const std::string& style, const std::string& title = "") {
    if (points.empty()) return;
    const std::string name = fmt::format("{}_{}", id_, count_++);
    data_ += data_block(name, points);
    plot_ += fmt::format("{}${} {} lc rgb '{}' {}", plot_.empty() ? "plot " : ", ", name, style, curve_color(color),
                         title.empty() ? "notitle" : fmt::format("title '{}'", title));
  }

  const std::string& data() const { return data_; }
  /// A panel without curves stays empty.
  std::string plot() const { return (plot_.empty() ? "set multiplot next" : plot_) + "\n"; }

 private:
  std::string id_, data_, plot_;
  int count_ = 0;
};

Points column(const std::vector<double>& t, const std::vector<std::vector<double>>& rows, std::size_t k) {
  Points points;
  for (std::size_t s = 0; s < t.size(); ++s) points.emplace_back(t[s], rows[s][k]);
  return points;
}

std::size_t width(const std::vector<std::vector<double>>& rows) {
  return rows.empty() ? 0 : rows.front().size();
}

void add_positions(const ControlRun& run, Panel& panel) {
  for (std::size_t k = 0; k < width(run.claimed.q); ++k)
    panel.add(column(run.claimed.t, run.claimed.q, k), k, "with lines lw 1.6", fmt::format("q_{}", k + 1));
  for (std::size_t k = 0; k < width(run.replayed.q); ++k)
    panel.add(column(run.replayed.t, run.replayed.q, k), k, "with points pt 6 ps 0.5");
}

/// Lines that end at a jump: a dot at its left limit, a bullet at its right one.
void add_velocities(const ControlRun& run, Panel& panel) {
  double least = 0, most = 0;
  for (const auto& v : run.claimed.v) {
    least = std::min(least, std::ranges::min(v));
    most = std::max(most, std::ranges::max(v));
  }
  for (std::size_t k = 0; k < width(run.claimed.v); ++k) {
    const Points v = column(run.claimed.t, run.claimed.v, k);
    Points line, left, right, between;
    for (std::size_t s = 0; s < v.size(); ++s) {
      if (s > 0 && v[s].first == v[s - 1].first && std::abs(v[s].second - v[s - 1].second) > kJump * (most - least)) {
        left.push_back(v[s - 1]);
        right.push_back(v[s]);
        between.insert(between.end(), {v[s - 1], v[s], {v[s].first, kGap}});
        line.emplace_back(v[s].first, kGap);
      }
      line.push_back(v[s]);
    }
    panel.add(line, k, "with lines lw 1.6");
    panel.add(between, k, "with lines lw 1 dt 3");
    panel.add(left, k, "with points pt 6 ps 0.45");
    panel.add(right, k, "with points pt 7 ps 0.45");
  }
}

void add_controls(const ControlRun& run, Panel& panel) {
  for (std::size_t k = 0; k < width(run.u); ++k) {
    Points points;
    const double H = run.T / static_cast<double>(run.u.size());
    for (std::size_t s = 0; s < run.u.size(); ++s) points.emplace_back(static_cast<double>(s) * H, run.u[s][k]);
    points.emplace_back(run.T, run.u.back()[k]);  // the last interval has an end
    panel.add(points, k, "with steps lw 1.6", fmt::format("u_{}", k + 1));
  }
}

/// Where the claimed motion has two points at one instant: the borders of the elements.
std::vector<double> borders(const ControlRun& run) {
  std::vector<double> t;
  for (std::size_t s = 1; s < run.claimed.t.size(); ++s) {
    if (run.claimed.t[s] == run.claimed.t[s - 1]) t.push_back(run.claimed.t[s]);
  }
  if (!run.claimed.t.empty()) t.push_back(run.claimed.t.back());
  return t;
}

/// A force over time: lines through the stages of an element, continued to its borders, where forces jump.
Points force_line(const Points& stages, const std::vector<double>& borders) {
  if (borders.size() < 2) return stages;
  Points line;
  for (std::size_t n = 0, s = 0; n + 1 < borders.size(); ++n) {
    Points element;
    while (s < stages.size() && stages[s].first <= borders[n + 1]) element.push_back(stages[s++]);
    if (element.empty()) continue;
    const auto extend = [](double t, const auto& near, const auto& far) {
      if (near.first == far.first) return std::pair(t, near.second);
      return std::pair(t, near.second + (near.second - far.second) * (t - near.first) / (near.first - far.first));
    };
    const auto second = element.size() > 1 ? element[1] : element[0];
    line.push_back(extend(borders[n], element[0], second));
    line.insert(line.end(), element.begin(), element.end());
    const auto before = element.size() > 1 ? element[element.size() - 2] : element.back();
    if (element.back().first < borders[n + 1]) line.push_back(extend(borders[n + 1], element.back(), before));
  }
  return line;
}

void add_normal_forces(const ControlRun& run, Panel& panel) {
  const auto ends = borders(run);
  for (std::size_t k = 0; k < width(run.lambda_n); ++k) {
    Points line = force_line(column(run.force_t, run.lambda_n, k), ends);
    for (auto& [t, force] : line) force = std::max(force, 0.0);  // what is continued may leave the cone
    panel.add(line, k, "with lines lw 1.6", run.contacts[k]);
  }
}

void add_friction_forces(const ControlRun& run, Panel& panel) {
  const auto ends = borders(run);
  for (std::size_t k = 0; k < run.friction.size(); ++k)
    panel.add(force_line(column(run.force_t, run.lambda_t, k), ends), static_cast<std::size_t>(run.friction[k]),
              "with lines lw 1.6");
}

void add_impulses(const ControlRun& run, Panel& panel) {
  for (const auto& impact : run.impacts) {
    const auto color = static_cast<std::size_t>(impact.contact);
    panel.add({{impact.t, impact.Lambda_n}}, color, "with impulses lw 2");
    panel.add({{impact.t, impact.Lambda_n}}, color, "with points pt 7 ps 0.6");
    for (const double Lambda_t : impact.Lambda_t) panel.add({{impact.t, Lambda_t}}, color, "with points pt 6 ps 0.6");
  }
}

bool has_friction(const ControlRun* run) {
  return !run->friction.empty();
}
bool has_impacts(const ControlRun* run) {
  return !run->impacts.empty();
}

struct Row {
  const char* label;
  void (*add)(const ControlRun& run, Panel& panel);
  bool is_shown;
};

}  // namespace

Figure FigureFolder::control(const std::vector<const ControlRun*>& runs, const std::string& name) {
  std::vector<Row> rows = {{"position", add_positions, true},
                           {"velocity", add_velocities, true},
                           {"control", add_controls, true},
                           {"normal force [N]", add_normal_forces, true},
                           {"friction [N]", add_friction_forces, std::ranges::any_of(runs, has_friction)},
                           {"impulse [N s]", add_impulses, std::ranges::any_of(runs, has_impacts)}};
  std::erase_if(rows, [](const Row& row) { return !row.is_shown; });
  std::string data, panels;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const ControlRun& run = *runs[r];
    panels += fmt::format("set label 1 '{}{}' at graph 0.5, 1.3 center font ',13' noenhanced\nset xrange [0:{:.10g}]\n",
                          run.discretisation, run.succeeded() ? "" : ": " + run.status, run.T > 0 ? run.T : 1);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      Panel panel(fmt::format("r{}p{}", r, k));
      rows[k].add(run, panel);
      data += panel.data();
      const bool is_last = k + 1 == rows.size();
      panels += fmt::format(
          "set label 2 '{}' at graph {}, 0.5 center rotate font ',12' noenhanced\nset format x '{}'\n{}", rows[k].label,
          runs.size() > 1 ? -0.1 : -0.09, is_last ? "%g" : "", is_last ? "set xlabel 't [s]'\n" : "");
      panels += panel.plot() + "unset label 1\n";
    }
    panels += "unset xlabel\n";
  }
  const auto height = static_cast<double>(80 + 150 * rows.size());
  const std::string script =
      gnuplot_head(runs.size() > 1 ? 1080 : 640, static_cast<int>(height)) + data +
      fmt::format("set output '{}.svg'\n", name) +
      fmt::format("set multiplot layout {},{} columnsfirst margins {},0.985,{:.4f},{:.4f} spacing 0.085,{:.4f}\n",
                  rows.size(), runs.size(), runs.size() > 1 ? 0.065 : 0.11, 62 / height, 1 - 50 / height, 42 / height) +
      "set xzeroaxis lc rgb '#b0b0b0' lt 1\nset offsets 0,0,graph 0.06,0\nset ytics font ',11'\n"
      "set key horizontal right bottom at graph 1,1.0 samplen 1.2 spacing 0.9 font ',10'\n" +
      panels + "unset multiplot\n";
  draw(name, script);
  return {name + ".svg", runs.front()->problem,
          fmt::format("{}. Lines: the motion that the optimisation claims; circles on it: the plant under its "
                      "controls. Velocities jump at impacts, from the open circle to the bullet. Forces of one contact "
                      "have one colour; its impulses are stems, open circles their tangential part. Time stepping has "
                      "no impulses: they are forces of a step; its stems are what such a step passes on.",
                      runs.front()->title)};
}

Figure FigureFolder::control_gradient(const std::vector<ControlGradient>& gradients, const std::string& name) {
  std::vector<const ControlGradient*> shown;  // the coarsest and the finest of each method
  for (std::size_t k = 0; k < gradients.size(); ++k) {
    const bool is_first = k == 0 || gradients[k - 1].method != gradients[k].method;
    const bool is_last = k + 1 == gradients.size() || gradients[k + 1].method != gradients[k].method;
    if (is_first || is_last) shown.push_back(&gradients[k]);
  }
  const auto& components = gradients.front().components;
  std::string data, panels, keys;
  for (std::size_t c = 0; c < components.size(); ++c) {
    std::string plot;
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
      plot += fmt::format("{}${} {}", plot.empty() ? "plot " : ", ", block_name, style);
      if (c == 0) keys += fmt::format("{}NaN {} title '{}'", m ? ", " : "plot [0:1][0:1] ", style, label);
    }
    panels += fmt::format("set ylabel 'd {}(T) / du'\n", components[c]) + plot + "\n";
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
      keys + "\nunset multiplot\n";
  draw(name, script);
  return {
      name + ".svg", "Derivatives of the terminal state",
      "Derivative of each component of the terminal state with respect to the control of each interval. FESD-J lies "
      "on the reference, time stepping does not, with any step length."};
}

Figure FigureFolder::seeds(const std::vector<SeedRun>& runs, const std::string& name) {
  const auto groups = seed_groups(runs);
  std::string data, panels;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Points stationary, others, failed;
    for (const SeedRun* run : groups[g]) {
      if (!run->succeeded())
        failed.emplace_back(run->cpu_seconds, 1);
      else
        (run->is_b_stationary ? stationary : others).emplace_back(run->cpu_seconds, run->cost);
    }
    Panel panel(fmt::format("g{}", g));
    panel.add(stationary, 0, "with points pt 7 ps 0.6", "B-stationary");
    panel.add(others, 1, "with points pt 6 ps 0.6", "others");
    panel.add(failed, 4, "axes x1y2 with points pt 2 ps 0.8 lw 1.6", "no solution");
    data += panel.data();
    panels +=
        fmt::format("set title \"{}\\n{}\" font ',11'\n", groups[g].front()->problem, groups[g].front()->arguments);
    panels += panel.plot();
  }
  const std::string script = gnuplot_head(460 * static_cast<int>(groups.size()), 460) + data +
                             fmt::format("set output '{}.svg'\n", name) +
                             fmt::format("set multiplot layout 1,{}\n", groups.size()) +
                             "set xlabel 'CPU time [s]'\nset ylabel 'cost'\nset xrange [0:*]\nset y2range [0:1]\n"
                             "set offsets graph 0.05,graph 0.05,graph 0.08,graph 0.05\nset bmargin 6\nset key at graph "
                             "0.5, -0.23 center horizontal samplen 1 font ',11'\n" +
                             panels + "unset multiplot\n";
  draw(name, script);
  return {name + ".svg", "Random initial guesses",
          "Cost over CPU time, one point per guess: the lower and the further left the better. Crosses on the upper "
          "frame: guesses without a solution."};
}

}  // namespace ricochet
