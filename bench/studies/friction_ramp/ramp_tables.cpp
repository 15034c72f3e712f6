#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/studies/friction_ramp/ramp_rows.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t k = 0; k < a.size(); ++k) worst = std::max(worst, std::abs(a[k] - b[k]));
  return worst;
}

double largest(const std::vector<double>& a) {
  double worst = 0;
  for (const double x : a) worst = std::max(worst, std::abs(x));
  return worst;
}

}  // namespace

int RampGrid::count(Cell cell) const {
  int n = 0;
  for (const auto& row : cells) n += static_cast<int>(std::count(row.begin(), row.end(), cell));
  return n;
}

int RampGrid::wrong_on_boundary() const {
  int n = 0;
  for (std::size_t k = 0; k < cells.size(); ++k)
    n += cells[k][k] == moves_but_should_rest || cells[k][k] == rests_but_should_move;
  return n;
}

double RampGrid::largest_error() const {
  double worst = 0;
  for (const auto& row : error) {
    for (const double x : row) worst = std::isnan(x) ? worst : std::max(worst, x);
  }
  return worst;
}

double RampGrid::largest_error_on_boundary() const {
  double worst = 0;
  for (std::size_t k = 0; k < error.size(); ++k) worst = std::isnan(error[k][k]) ? worst : std::max(worst, error[k][k]);
  return worst;
}

std::vector<RampGrid> whole_grids(const std::vector<RampGrid>& parts) {
  std::vector<RampGrid> grids;
  for (const RampGrid& part : parts) {
    const auto first_row = static_cast<std::size_t>(part.first_row);
    const auto begun = std::ranges::find_if(grids, [&](const RampGrid& grid) {
      return grid.method == part.method && grid.setting == part.setting && grid.v_0 == part.v_0 &&
             grid.values == part.values && grid.cells.size() == first_row && first_row > 0;
    });
    if (begun != grids.end()) {
      begun->error.insert(begun->error.end(), part.error.begin(), part.error.end());
      begun->cells.insert(begun->cells.end(), part.cells.begin(), part.cells.end());
      begun->seconds += part.seconds;
      if (begun->message.empty()) begun->message = part.message;
    } else if (first_row == 0) {
      grids.push_back(part);
    } else {
      throw InputError("first_row", part.first_row, fmt::format("no row of {} ends in front of it", part.method));
    }
  }
  std::erase_if(grids,
                [](const RampGrid& grid) { return !grid.cells.empty() && grid.cells.size() < grid.values.size(); });
  return grids;
}

Table ramp_table(const std::vector<RampGrid>& grids) {
  using G = RampGrid;
  // A method that declines has no cells.
  const auto of_cells = [](auto value) { return [=](const G& g) { return when(!g.cells.empty(), value(g)); }; };
  static const std::vector<Column<G>> columns = {
      {"method", &G::method},
      {"setting", &G::setting},
      {"v_0", "m/s", "{:g}", &G::v_0},
      {"ramps", "", "{}", [](const G& g) { return g.cells.size() * g.cells.size(); }},
      {"failed", "", "{}", of_cells([](const G& g) { return g.count(G::failed) + g.count(G::declined); })},
      {"wrong decision", "", "{}", of_cells([](const G& g) { return g.wrong(); })},
      {"of these at tan = mu", "", "{}", of_cells([](const G& g) { return g.wrong_on_boundary(); })},
      {"largest error", "m", "{:.1e}", of_cells([](const G& g) { return g.largest_error(); })},
      {"largest at tan = mu", "m", "{:.1e}", of_cells([](const G& g) { return g.largest_error_on_boundary(); })},
      {"a run", "us", "{:.3g}",
       of_cells([](const G& g) { return 1e6 * g.seconds / static_cast<double>(g.cells.size() * g.cells.size()); })},
      {"why failed", &G::message},
  };
  return without_empty(
      table_of(
          "A block on a ramp: does it stick?", columns, grids,
          "A block at rest sticks if and only if tan(slope) <= mu. v_0 = 0: it starts at rest; v_0 < 0: it is thrown "
          "up the ramp and stops there. Wrong: it moves at the end with more than 1e-3 m/s and should rest, or vice "
          "versa. Error: that of the final position."),
      {"a run [us]"});
}

Table ramp_facets_table(const std::vector<RampFacets>& facets) {
  using F = RampFacets;
  constexpr double degrees = 180 / std::numbers::pi;
  static const std::vector<Column<F>> columns = {
      {"method", &F::method},
      {"facets", "", "{}", [](const F& f) { return f.facets ? fmt::format("{}", f.facets) : "disc"; }},
      {"sticks up to tan/mu, least", "", "{:.4f}", [](const F& f) { return std::ranges::min(f.limit); }},
      {"from its polygon", "", "{:.1e}", [](const F& f) { return largest_difference(f.limit, f.limit_exact); }},
      {"drift, worst", "deg", "{:.3f}", [](const F& f) { return degrees * largest(f.drift); }},
      {"from its polygon", "deg", "{:.1e}",
       [](const F& f) { return degrees * largest_difference(f.drift, f.drift_exact); }},
  };
  const auto measured = rows_where(facets, [](const F& f) { return !f.limit.empty(); });
  return table_of(
      "A polygon in place of the friction disc", columns, measured,
      "Maxima over the downhill direction. Drift: angle between the downhill direction and the displacement of a block "
      "that slips from rest at the load of the figure. From its polygon: largest difference from the exact solution "
      "with that polygon, equations 3 and 4 of "
      "bench/studies/friction_ramp/friction_ramp.h.");
}

}  // namespace ricochet
