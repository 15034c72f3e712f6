#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/studies/control/control_run.h"
#include "reports/gnuplot.h"

namespace ricochet {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
// A velocity that changes by less of the range of all velocities at one instant does not jump.
constexpr double kJump = 1e-3;

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

Figure draw_control(const FigureFolder& folder, const std::vector<const ControlRun*>& runs, const std::string& name) {
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
  folder.draw(name, script);
  return {name + ".svg", runs.front()->problem,
          fmt::format("{}. Lines: the motion that the optimisation claims; circles on it: the plant under its "
                      "controls. Velocities jump at impacts, from the open circle to the bullet. Forces of one contact "
                      "have one colour; its impulses are stems, open circles their tangential part. Time stepping has "
                      "no impulses: they are forces of a step; its stems are what such a step passes on.",
                      runs.front()->title)};
}

}  // namespace ricochet
