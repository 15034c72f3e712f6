#include "reports/ramp_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reports/json_number.h"

namespace ricochet {
namespace {

using nlohmann::json;

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

json to_json(const RampGrid& g) {
  return {{"kind", "ramp_grid"}, {"method", g.method},   {"setting", g.setting},
          {"v_0", g.v_0},        {"values", g.values},   {"error", g.error},
          {"cells", g.cells},    {"seconds", g.seconds}, {"message", g.message}};
}

RampGrid ramp_grid_from_json(const json& j) {
  RampGrid g;
  j.at("method").get_to(g.method);
  j.at("setting").get_to(g.setting);
  j.at("v_0").get_to(g.v_0);
  j.at("values").get_to(g.values);
  for (const auto& row : j.at("error")) {
    g.error.emplace_back();
    for (const auto& x : row) g.error.back().push_back(number_or_nan(x));
  }
  j.at("cells").get_to(g.cells);
  j.at("seconds").get_to(g.seconds);
  j.at("message").get_to(g.message);
  return g;
}

json to_json(const RampFacets& f) {
  return {{"kind", "ramp_facets"},       {"method", f.method}, {"facets", f.facets},           {"load", f.load},
          {"direction", f.direction},    {"limit", f.limit},   {"limit_exact", f.limit_exact}, {"drift", f.drift},
          {"drift_exact", f.drift_exact}};
}

RampFacets ramp_facets_from_json(const json& j) {
  RampFacets f;
  j.at("method").get_to(f.method);
  j.at("facets").get_to(f.facets);
  j.at("load").get_to(f.load);
  j.at("direction").get_to(f.direction);
  for (const auto& [name, list] : {std::pair("limit", &f.limit), std::pair("limit_exact", &f.limit_exact),
                                   std::pair("drift", &f.drift), std::pair("drift_exact", &f.drift_exact)}) {
    for (const auto& x : j.at(name)) list->push_back(number_or_nan(x));
  }
  return f;
}

Table ramp_table(const std::vector<RampGrid>& grids) {
  Table table;
  table.title = "A block on a ramp: does it stick?";
  table.columns = {{"method", true},
                   {"setting", true},
                   {"v_0 [m/s]"},
                   {"ramps"},
                   {"failed"},
                   {"wrong decision"},
                   {"of these at tan = mu"},
                   {"largest error [m]"},
                   {"largest at tan = mu"},
                   {"us a run"},
                   {"why failed", true}};
  for (const auto& g : grids) {
    const std::size_t ramps = g.values.size() * g.values.size();
    if (g.cells.empty()) {
      table.rows.push_back(
          {g.method, g.setting, fmt::format("{:g}", g.v_0), "0", "-", "-", "-", "-", "-", "-", g.message});
      continue;
    }
    table.rows.push_back({g.method, g.setting, fmt::format("{:g}", g.v_0), fmt::format("{}", ramps),
                          fmt::format("{}", g.count(RampGrid::failed)), fmt::format("{}", g.wrong()),
                          fmt::format("{}", g.wrong_on_boundary()), scientific(g.largest_error()),
                          scientific(g.largest_error_on_boundary()),
                          fmt::format("{:.3g}", 1e6 * g.seconds / static_cast<double>(ramps)), g.message});
  }
  table.note =
      "At rest the block sticks exactly when tan(slope) <= mu. v_0 = 0: it starts at rest; v_0 < 0: it is thrown up "
      "the "
      "ramp, stops, and has to decide then. Wrong: it moves at the end with more than 1e-3 m/s and should rest, or the "
      "other way round. Error: of the position at the end.";
  return table;
}

Table ramp_facets_table(const std::vector<RampFacets>& facets) {
  Table table;
  table.title = "A polygon in place of the friction disc";
  table.columns = {{"method", true},
                   {"facets"},
                   {"sticks up to tan/mu, least"},
                   {"from its polygon"},
                   {"drift, worst [deg]"},
                   {"from its polygon [deg]"}};
  const double degrees = 180 / std::numbers::pi;
  for (const auto& f : facets) {
    if (f.limit.empty()) continue;
    table.rows.push_back({f.method, f.facets ? fmt::format("{}", f.facets) : "disc",
                          fmt::format("{:.4f}", *std::min_element(f.limit.begin(), f.limit.end())),
                          scientific(largest_difference(f.limit, f.limit_exact)),
                          fmt::format("{:.3f}", degrees * largest(f.drift)),
                          scientific(degrees * largest_difference(f.drift, f.drift_exact))});
  }
  table.note =
      "Over the direction of the way down. Drift: the angle between the way down and the displacement of a block that "
      "slips from rest at the load of the figure. From its polygon: the largest difference to the exact solution with "
      "that polygon, equations 3 and 4 of bench/studies/friction_ramp.h.";
  return table;
}

}  // namespace ricochet
