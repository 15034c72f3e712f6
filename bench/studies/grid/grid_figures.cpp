#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "bench/studies/grid/curve_style.h"
#include "bench/studies/grid/grid_tables.h"
#include "problems/input_error.h"
#include "reports/order_fit.h"

namespace ricochet {
namespace {

struct CurveFamily {
  std::string name;
  std::vector<std::string> methods;
};

/// Methods with fixed steps, in the order of the results; those without a tableau are one family.
std::vector<CurveFamily> families_of(const GridResults& results) {
  std::vector<CurveFamily> families;
  for (const auto& method : results.methods()) {
    if (results.of(method).front()->setting.steps == 0) continue;
    const std::string name = curve_family(method);
    const auto known = std::ranges::find(families, name, &CurveFamily::name);
    if (known == families.end())
      families.push_back({name, {method}});
    else
      known->methods.push_back(method);
  }
  return families;
}

/// A line of the nominal order through the middle of the window of a fit.
Chart::Points nominal_slope(const std::vector<const Run*>& runs, const OrderFit& fit) {
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
  Chart::Points line;
  for (const Run* end : {window.front(), window.back()})
    line.emplace_back(end->h_bar, std::pow(10, y + runs.front()->nominal_order * (std::log10(end->h_bar) - x)));
  return line;
}

/// Adds the curves of one method: its runs, its nominal order, what failed and what was run instead.
void add_method(const GridResults& results, const std::string& method, Chart::Panel& panel) {
  const auto runs = results.of(method);
  Chart::Points solved, failed, replaced;
  for (const Run* run : runs) {
    if (run->succeeded())
      solved.emplace_back(run->h_bar, std::max(run->error, kLeastDrawn));
    else
      failed.emplace_back(run->h_bar, Chart::kAuto);
  }
  for (const auto& other : results.records) {
    if (other.instead_of == method && other.has_error()) replaced.emplace_back(other.h_bar, other.error);
  }
  const ObservedOrder order = observe_order(runs);
  const std::string fitted = order.fit ? fmt::format("slope {:.2f} ± {:.2f}", order.fit->slope, order.fit->half_width)
                                       : "no order: " + order.no_fit;
  const CurveLook look = curve_look(results, method);
  panel.add(curve_label(results, *runs.front()) + ", " + fitted, look, Chart::Drawn::both, solved);
  if (order.fit) panel.add("", {.colour = look.colour, .dash = 1}, Chart::Drawn::line, nominal_slope(runs, *order.fit));
  panel.add("", look, Chart::Drawn::failed, failed);
  panel.add("", {.colour = look.colour, .is_open = true}, Chart::Drawn::marks, replaced);
}

std::string file_of(const GridResults& results, const CurveFamily& family) {
  std::string file = results.id + "_order_" + family.name;
  std::ranges::replace_if(
      file, [](char c) { return c == ':' || c == ' '; }, '_');
  return file;
}

}  // namespace

Chart order_chart(const GridResults& results) {
  Chart chart{.name = "error_over_step",
              .file = results.id + "_order",
              .title = "Error over step length",
              .caption =
                  "Error over the mean length of a Runge-Kutta step. Dashed: the nominal order. Crosses on the "
                  "upper frame: runs without a solution; open circles: the same runs with elements added as "
                  "needed. " +
                  results.error_measure().definition,
              .width = 530,
              .height = 430};
  for (const auto& family : families_of(results)) {
    Chart::Panel panel{.title = family_title(family.name),
                       .x = {.label = "step length h̄ = T / (N_sim N_FE)  [s]", .is_log = true},
                       .y = {.label = results.error_measure().axis, .is_log = true},
                       .file = file_of(results, family)};
    for (const auto& method : family.methods) add_method(results, method, panel);
    const auto has_error = [](const Chart::Series& series) { return series.drawn == Chart::Drawn::both; };
    if (std::ranges::any_of(panel.series, has_error)) chart.panels.push_back(panel);
  }
  return chart;
}

Chart trajectory_chart(const Trajectory& trajectory, const std::string& file) {
  const std::string run = fmt::format("{}, {}, {}", trajectory.problem, trajectory.method, trajectory.setting);
  Chart chart{.name = "trajectory",
              .file = file,
              .title = "Motion",
              .caption = fmt::format("{} as {} {} computes it, between its steps as the method itself says. Velocities "
                                     "jump at impacts.",
                                     trajectory.problem, trajectory.method, trajectory.setting),
              .columns = 1,
              .width = 860,
              .height = 190,
              .has_key_each = true};
  chart.panels = {{.title = run, .x = {}, .y = {.label = "q [m, rad]"}},
                  {.title = "", .x = {.label = "t [s]"}, .y = {.label = "v [m/s, rad/s]"}}};
  for (Chart::Panel& panel : chart.panels) {
    if (!trajectory.t.empty())
      std::tie(panel.x.from, panel.x.to) = std::pair(trajectory.t.front(), trajectory.t.back());
    const bool is_q = &panel == &chart.panels.front();
    const auto& rows = is_q ? trajectory.q : trajectory.v;
    for (std::size_t k = 0; k < (rows.empty() ? 0 : rows.front().size()); ++k) {
      Chart::Points points;
      for (std::size_t s = 0; s < rows.size(); ++s) points.emplace_back(trajectory.t[s], rows[s][k]);
      panel.add(fmt::format("{}[{}]", is_q ? "q" : "v", k), CurveLook::plain(k), Chart::Drawn::line, points);
    }
  }
  return chart;
}

}  // namespace ricochet
