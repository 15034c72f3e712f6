#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/studies/friction_ramp/ramp_rows.h"
#include "methods/method_spec.h"

namespace ricochet {
namespace {

constexpr double kLeastError = 1e-16;  // of the colour scale; an error of zero has its colour
constexpr int kColumns = 5;

/// Errors as colours, and the cells in which the block does something else than it should.
void add_cells(const RampGrid& grid, Chart::Panel& panel) {
  Chart::Series errors{.drawn = Chart::Drawn::cells};
  Chart::Points wrong, failed;
  for (std::size_t row = 0; row < grid.values.size(); ++row) {
    for (std::size_t column = 0; column < grid.values.size(); ++column) {
      const std::pair place(grid.values[column], grid.values[row]);
      errors.points.push_back(place);
      errors.values.push_back(std::log10(std::max(grid.error[row][column], kLeastError)));
      if (grid.cells[row][column] == RampGrid::right) continue;
      (grid.cells[row][column] == RampGrid::failed ? failed : wrong).push_back(place);
    }
  }
  panel.series.push_back(errors);
  panel.add("tan(slope) = μ", {}, Chart::Drawn::reference, {{0, 0}, {1, 1}});
  panel.add("moves and should rest, or rests and should move", {.colour = 1}, Chart::Drawn::marks, wrong);
  panel.add("failed", {.colour = 7, .symbol = 4}, Chart::Drawn::marks, failed);
}

/// The mark of a method.
CurveLook look_of(const std::string& method) {
  const std::string name = MethodSpec(method).name();
  if (name == "fesd") return {.symbol = 0, .is_open = true};
  return {.symbol = name == "moreau_jean" ? 5 : 4};
}

}  // namespace

Chart ramp_chart(const std::vector<RampGrid>& grids, const std::string& name) {
  Chart chart{
      .name = "errors",
      .file = name,
      .title = "A block on a ramp",
      .caption = fmt::format(
          "Error of the position at the end of a block with the initial speed {:g} m/s down the ramp, over the "
          "slope and the friction coefficient. Line: tan(slope) = μ, below which it does not stay. Dots: it moves "
          "at the end and should rest, or the other way round. Crosses: the run failed.",
          grids.back().v_0),
      .columns = kColumns,
      .width = 170,
      .height = 170,
      .scale = {.label = "error of the position at the end [m]", .from = std::log10(kLeastError), .to = 0}};
  for (const auto& grid : grids) {
    if (grid.v_0 != grids.back().v_0 || grid.count(RampGrid::declined) > 0) continue;
    const bool is_left = chart.panels.size() % kColumns == 0;
    Chart::Panel& panel =
        chart.panels.emplace_back(Chart::Panel{.title = grid.method + "\n" + grid.setting,
                                               .x = {.label = "", .from = -0.02, .to = 1.02},
                                               .y = {.label = is_left ? "μ" : "", .from = -0.02, .to = 1.02}});
    add_cells(grid, panel);
  }
  for (std::size_t k = chart.panels.size() - std::min<std::size_t>(kColumns, chart.panels.size());
       k < chart.panels.size(); ++k)
    chart.panels[k].x.label = "tan(slope)";
  return chart;
}

Chart ramp_facets_chart(const std::vector<RampFacets>& facets, const std::string& name) {
  const double degrees = 180 / std::numbers::pi;
  Chart chart{.name = "polygons_over_directions",
              .file = name,
              .title = "Polygons in place of the friction disc",
              .caption = fmt::format(
                  "Left: the largest slope at which a block stays, over the direction of the way down. Right: where it "
                  "goes when it slips from rest, tan(slope) = {:g} μ. Lines: the exact solution with the disc or the "
                  "polygon; marks: methods.",
                  facets.front().load)};
  const Chart::Axis direction{.label = "direction of the way down, from a vertex [°]", .from = 0, .to = 90};
  chart.panels = {{.title = "", .x = direction, .y = {.label = "sticks up to tan(slope) / μ"}},
                  {.title = "", .x = direction, .y = {.label = "drift from the way down [°]"}}};
  std::vector<int> shapes;  // polygons whose exact solution is there already
  for (const RampFacets& f : facets) {
    const auto known = std::ranges::find(shapes, f.facets);
    const int colour = CurveLook::of(static_cast<std::size_t>(known - shapes.begin())).colour;
    const auto curve = [&](const std::vector<double>& values, double unit) {
      Chart::Points points;
      for (std::size_t i = 0; i < values.size(); ++i) points.emplace_back(degrees * f.direction[i], unit * values[i]);
      return points;
    };
    const std::string shape = f.facets ? fmt::format("{} facets", f.facets) : "disc";
    if (known == shapes.end()) {
      shapes.push_back(f.facets);
      chart.panels[0].add(shape + ", exact", {.colour = colour}, Chart::Drawn::line, curve(f.limit_exact, 1));
      chart.panels[1].add(shape + ", exact", {.colour = colour}, Chart::Drawn::line, curve(f.drift_exact, degrees));
    }
    CurveLook look = look_of(f.method);
    look.colour = colour;
    const std::string label = fmt::format("{}: {}", shape, f.method);
    chart.panels[0].add(label, look, Chart::Drawn::marks, curve(f.limit, 1));
    chart.panels[1].add(label, look, Chart::Drawn::marks, curve(f.drift, degrees));
  }
  return chart;
}

}  // namespace ricochet
