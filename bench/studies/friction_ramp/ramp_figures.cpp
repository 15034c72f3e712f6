#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "bench/studies/friction_ramp/ramp_rows.h"
#include "methods/method_spec.h"
#include "reports/gnuplot.h"

namespace ricochet {
namespace {

constexpr double kLeastError = 1e-16;  // of the colour scale; an error of zero has its colour
constexpr int kColumns = 5;

/// "x y log10(error)" of all cells that have an error; then the centres of those of one kind.
std::string cell_block(const std::string& name, const RampGrid& grid) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (std::size_t row = 0; row < grid.values.size(); ++row) {
    for (std::size_t column = 0; column < grid.values.size(); ++column) {
      const double error = grid.error[row][column];
      text += fmt::format("{:.6g} {:.6g} {}\n", grid.values[column], grid.values[row],
                          std::isnan(error) ? "NaN" : fmt::format("{:.2f}", std::log10(std::max(error, kLeastError))));
    }
  }
  return text + "EOD\n";
}

std::vector<std::pair<double, double>> cells_where(const RampGrid& grid, bool are_failed) {
  std::vector<std::pair<double, double>> points;
  for (std::size_t row = 0; row < grid.values.size(); ++row) {
    for (std::size_t column = 0; column < grid.values.size(); ++column) {
      const int cell = grid.cells[row][column];
      if (cell != RampGrid::right && (cell == RampGrid::failed) == are_failed)
        points.emplace_back(grid.values[column], grid.values[row]);
    }
  }
  return points;
}

/// gnuplot's point of a method.
int point_of(const std::string& method) {
  const std::string name = MethodSpec(method).name();
  return name == "fesd" ? 6 : name == "moreau_jean" ? 1 : 2;
}

}  // namespace

Figure draw_ramps(const FigureFolder& folder, const std::vector<RampGrid>& grids, const std::string& name) {
  std::vector<const RampGrid*> shown;
  for (const auto& grid : grids) {
    const bool is_declined = grid.message.starts_with("declined");
    if (grid.v_0 == grids.back().v_0 && !is_declined) shown.push_back(&grid);
  }
  std::string data, panels;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const RampGrid& grid = *shown[k];
    const std::string id = fmt::format("g{}", k);
    data += cell_block(id, grid);
    PlotCommand plot;
    plot.add(fmt::format("${} using 1:2:3 with image pixels notitle", id));
    plot.add("x with lines lw 1.2 lc rgb '#000000' notitle");
    for (const bool are_failed : {false, true}) {
      const auto points = cells_where(grid, are_failed);
      if (points.empty()) continue;
      const std::string marked = id + (are_failed ? "_failed" : "_wrong");
      data += data_block(marked, points);
      plot.add(fmt::format("${} with points pt {} ps 0.35 lw 1 lc rgb '{}' notitle", marked, are_failed ? 2 : 7,
                           are_failed ? "#969696" : "#e31a1c"));
    }
    const bool is_left = k % kColumns == 0, is_low = k + kColumns >= shown.size();
    panels += fmt::format("set title {}.\"\\n{}\" font ',11'\nset ylabel '{}'\nset xlabel '{}'\n",
                          gnuplot_text(grid.method), grid.setting, is_left ? "μ" : "", is_low ? "tan(slope)" : "") +
              plot.text();
  }
  const int rows = (static_cast<int>(shown.size()) + kColumns - 1) / kColumns;
  const int height = 120 + 235 * rows;
  folder.draw(
      name,
      gnuplot_head(1080, height) + data + fmt::format("set output '{}.svg'\n", name) +
          fmt::format("set multiplot layout {},{} margins 0.06,0.89,{:.3f},{:.3f} spacing 0.035,{:.3f}\n", rows,
                      kColumns, 60.0 / height, 1 - 60.0 / height, 75.0 / height) +
          "set size square\nunset grid\nset border 15\nset xrange [-0.02:1.02]\nset yrange [-0.02:1.02]\n"
          "set xtics 0.5\nset ytics 0.5\nset cbrange [-16:0]\nset format cb '10^{%g}'\n"
          // ColorBrewer's YlGnBu: light is exact.
          "set palette defined (0 '#ffffd9', 1 '#c7e9b4', 2 '#41b6c4', 3 '#225ea8', 4 '#081d58')\n"
          "unset colorbox\n" +
          panels +
          // One colour scale for all panels.
          "set size nosquare\nset lmargin at screen 0.9\nset rmargin at screen 0.905\nset bmargin at screen 0.25\n"
          "set tmargin at screen 0.75\nunset border\nunset tics\nunset xlabel\nunset ylabel\nunset title\n"
          "set colorbox user origin screen 0.915,0.25 size screen 0.015,0.5\nset cbtics 4\n"
          "set cblabel 'error of the position at the end [m]'\n"
          "plot [0:1][0:1] '-' using 1:2:3 with image pixels notitle\n-1 -1 0\n-2 -1 0\n-1 -2 0\n-2 -2 0\ne\n"
          "unset multiplot\n");
  return {
      name + ".svg", "A block on a ramp",
      fmt::format("Error of the position at the end of a block with the initial speed {:g} m/s down the ramp, over "
                  "the slope and the friction coefficient. Line: tan(slope) = mu, below which it does not stay. Red: "
                  "it moves at the end and should rest, or the other way round. Crosses: the run failed.",
                  grids.back().v_0)};
}

Figure draw_ramp_facets(const FigureFolder& folder, const std::vector<RampFacets>& facets, const std::string& name) {
  const double degrees = 180 / std::numbers::pi;
  std::string data;
  PlotCommand limits, drifts;
  std::vector<int> drawn;  // polygons whose exact solution is there already
  for (std::size_t k = 0; k < facets.size(); ++k) {
    const RampFacets& f = facets[k];
    const auto known = std::find(drawn.begin(), drawn.end(), f.facets);
    const std::string& color = curve_color(static_cast<std::size_t>(known - drawn.begin()));
    std::vector<std::pair<double, double>> limit, limit_exact, drift, drift_exact;
    for (std::size_t i = 0; i < f.direction.size(); ++i) {
      const double x = degrees * f.direction[i];
      limit.emplace_back(x, f.limit[i]);
      limit_exact.emplace_back(x, f.limit_exact[i]);
      drift.emplace_back(x, degrees * f.drift[i]);
      drift_exact.emplace_back(x, degrees * f.drift_exact[i]);
    }
    const std::string id = fmt::format("f{}", k), shape = f.facets ? fmt::format("{} facets", f.facets) : "disc";
    data += data_block(id + "l", limit) + data_block(id + "d", drift);
    if (known == drawn.end()) {
      drawn.push_back(f.facets);
      data += data_block(id + "le", limit_exact) + data_block(id + "de", drift_exact);
      limits.add(fmt::format("${}le with lines lw 1.6 lc rgb '{}' title '{}, exact'", id, color, shape));
      drifts.add(fmt::format("${}de with lines lw 1.6 lc rgb '{}' notitle", id, color));
    }
    const int point = point_of(f.method);
    limits.add(fmt::format("${}l with points pt {} ps 0.7 lc rgb '{}' notitle", id, point, color));
    drifts.add(fmt::format("${}d with points pt {} ps 0.7 lc rgb '{}' notitle", id, point, color));
  }
  for (const auto& [point, family] :
       {std::pair(6, "FESD-J"), std::pair(1, "Moreau-Jean"), std::pair(2, "Anitescu-Potra")})
    limits.add(fmt::format("NaN with points pt {} ps 0.7 lc rgb '#404040' title '{}'", point, family));
  folder.draw(
      name,
      gnuplot_head(1080, 520) + data + fmt::format("set output '{}.svg'\n", name) +
          "set multiplot layout 1,2 margins 0.1,0.98,0.14,0.96 spacing 0.09,0.1\nset xrange [0:90]\nset xtics 15\n"
          "set xlabel 'direction of the way down, from a vertex [°]'\n"
          "set key at graph 0.5, graph 0.42 center center vertical maxcols 1 reverse Left samplen 2 font ',12'\n"
          "set ylabel 'sticks up to tan(slope) / μ'\nset yrange [0.68:1.02]\n" +
          limits.text() + "set key off\nset ylabel 'drift from the way down [°]'\nset yrange [*:*]\n" + drifts.text() +
          "unset multiplot\n");
  return {
      name + ".svg", "Polygons in place of the friction disc",
      fmt::format("Left: the largest slope at which a block stays, over the direction of the way down. Right: where "
                  "it goes when it slips from rest, tan(slope) = {:g} mu. Lines: the exact solution with the disc or "
                  "the polygon; points: methods.",
                  facets.front().load)};
}

}  // namespace ricochet
