#include "bench/studies/friction_ramp/friction_ramp.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "bench/experiment/study.h"
#include "bench/measure/measure_run.h"
#include "bench/rows/progress.h"
#include "bench/studies/friction_ramp/ramp_rows.h"
#include "methods/contact_laws/friction_polygon.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kMoves = 1e-3;          // [m/s]; the slowest that should move in the grid of 33 has 100 times as much
constexpr int kLoadBisections = 20;      // for the load at which it begins to move: to 1e-6
constexpr double kSmallestDrift = 1e-9;  // [m/s]; a load 1e-6 above the limit gives a thousand times as much

struct Entry {
  std::string name;
  std::unique_ptr<Method> method;
  Settings settings;
  int stride = 1;
  std::string text;  // of the setting
};

Entry entry_of(const json& j) {
  Entry entry;
  entry.name = j.at("method");
  entry.method = make_method(entry.name);
  require_kind_of_setting(*entry.method, j.contains("steps") ? "methods: steps" : "",
                          j.contains("tolerance") ? "methods: tolerance" : "");
  const Setting setting = setting_of(*entry.method, j.value("steps", 0), j.value("tolerance", 0.0));
  entry.settings.steps = setting.steps;
  entry.settings.tolerance = setting.tolerance;
  entry.text = setting.text();
  entry.stride = j.value("stride", 1);
  return entry;
}

/// The methods of the experiment; with "others", {"steps": N, "tolerance": TOL}, also the first example of every
/// registered method that it does not name.
void name_methods(json& document) {
  json& named = document.at("methods");
  if (named != "all" && !document.contains("others")) return;
  if (named == "all") named = json::array();
  const json given = named;
  for (const auto& registered : methods()) {
    const auto is_it = [&](const json& j) {
      return MethodSpec(j.at("method").get<std::string>()).name() == registered.name;
    };
    if (!registered.make || registered.examples.empty() || std::ranges::any_of(given, is_it)) continue;
    const char* setting =
        setting_of(*make_method(registered.examples.front()), 1, 1).is_tolerance() ? "tolerance" : "steps";
    named.push_back({{"method", registered.examples.front()}, {setting, document.at("others").at(setting)}});
  }
  document.erase("others");
}

std::vector<Entry> entries_of(json document) {
  name_methods(document);
  std::vector<Entry> entries;
  for (const auto& j : document.at("methods")) entries.push_back(entry_of(j));
  return entries;
}

/// @param row  of the grid of the experiment, which the entry's stride has
RampGrid empty_row(const Entry& entry, double v_0, int size, int row) {
  RampGrid grid;
  grid.method = entry.name;
  grid.setting = entry.text;
  grid.v_0 = v_0;
  for (int k = 0; k < size; k += entry.stride) grid.values.push_back(static_cast<double>(k) / (size - 1));
  grid.first_row = row / entry.stride;
  grid.error = {std::vector<double>(grid.values.size(), kNaN)};
  grid.cells = {std::vector<int>(grid.values.size(), RampGrid::failed)};
  return grid;
}

void run_ramp(const Entry& entry, const Problem& ramp, const ExactRamp::State& exact, std::size_t column,
              RampGrid& grid) {
  const auto begin = std::chrono::steady_clock::now();
  const Solution s = entry.method->solve(ramp, entry.settings);
  grid.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!s.succeeded()) {
    if (grid.message.empty()) grid.message = fmt::format("{}: {}", to_string(s.status), s.message);
    return;
  }
  grid.error[0][column] = std::abs(s.q[0] - exact.x);
  const bool moves = std::abs(s.v[0]) > kMoves, should = std::abs(exact.v) > kMoves;
  grid.cells[0][column] = moves == should ? RampGrid::right
                          : moves         ? RampGrid::moves_but_should_rest
                                          : RampGrid::rests_but_should_move;
}

/// The entries that have ramps in a row of the grid.
std::vector<const Entry*> entries_in_row(const std::vector<Entry>& entries, int row) {
  std::vector<const Entry*> list;
  for (const Entry& entry : entries) {
    if (row % entry.stride == 0) list.push_back(&entry);
  }
  return list;
}

/// The ramps of one friction coefficient with one initial speed, by each of the entries. A problem is made once for all
/// methods: that takes longer than most runs.
std::vector<RampGrid> run_row(const std::vector<const Entry*>& entries, double v_0, int size, int row, double T,
                              bool with_times) {
  std::vector<RampGrid> grids;
  for (const Entry* entry : entries) grids.push_back(empty_row(*entry, v_0, size, row));
  for (int column = 0; column < size; ++column) {
    const ExactRamp exact{
        .mu = static_cast<double>(row) / (size - 1), .tangent = static_cast<double>(column) / (size - 1), .v_0 = v_0};
    std::unique_ptr<Problem> ramp;
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const Entry& entry = *entries[k];
      if (column % entry.stride != 0) continue;
      if (!ramp)
        ramp = make_problem("block_on_ramp",
                            {{"mu", exact.mu}, {"slope", std::atan(exact.tangent)}, {"v_x0", v_0}, {"duration", T}});
      const auto cell = static_cast<std::size_t>(column / entry.stride);
      if (const Support support = entry.method->can_run(ramp->info()); support.ok) {
        run_ramp(entry, *ramp, exact.at(T), cell, grids[k]);
      } else {
        grids[k].cells[0][cell] = RampGrid::declined;
        if (grids[k].message.empty()) grids[k].message = "declined: " + support.reason;
      }
    }
  }
  for (RampGrid& grid : grids) {
    if (!with_times) grid.seconds = kNaN;
  }
  return grids;
}

/// Final state of a block that starts at rest. @param load  tan(slope) / mu
Solution slide(const Entry& entry, double load, double direction, double T) {
  constexpr double mu = 0.5;
  const auto ramp = make_problem(
      "block_on_ramp_3d", {{"mu", mu}, {"slope", std::atan(load * mu)}, {"direction", direction}, {"duration", T}});
  return entry.method->solve(*ramp, entry.settings);
}

/// Over a quarter of the directions: the polygons repeat themselves.
RampFacets run_facets(const json& entry_json, int n, double load, double T) {
  const auto angle = [](const std::array<double, 2>& x, double direction) {
    return std::remainder(std::atan2(x[1], x[0]) - direction, 2 * std::numbers::pi);
  };
  const Entry entry = entry_of(entry_json);
  RampFacets line;
  line.method = entry.name;
  line.facets = entry_json.at("facets");
  line.load = load;
  for (int k = 0; k < n; ++k) {
    const double direction = 0.5 * std::numbers::pi * k / (n - 1);
    const ExactFacets exact{.facets = line.facets, .direction = direction};
    line.direction.push_back(direction);
    double sticks = 0, moves = load;
    for (int bisection = 0; bisection < kLoadBisections; ++bisection) {
      const double middle = 0.5 * (sticks + moves);
      const Solution s = slide(entry, middle, direction, T);
      const bool is_moving = !s.succeeded() || s.v.head(2).norm() > kSmallestDrift;
      (is_moving ? moves : sticks) = middle;
    }
    line.limit.push_back(0.5 * (sticks + moves));
    line.limit_exact.push_back(exact.limit());
    const Solution s = slide(entry, load, direction, T);
    line.drift.push_back(s.succeeded() ? angle({s.q[0], s.q[1]}, direction) : kNaN);
    line.drift_exact.push_back(angle(exact.drift(load), direction));
  }
  return line;
}

/// A piece is a row of the grid with one initial speed, and after all of them a method with its polygon.
void run_friction_ramp(const json& experiment, ResultsFile& file) {
  const int size = experiment.at("grid");
  if (size < 2) throw InputError("grid", size, "at least 2 is required");
  const double T = experiment.at("duration");
  const bool with_times = experiment.value("times", true);
  const std::vector<Entry> entries = entries_of(experiment);
  for (const Entry& entry : entries) {
    if ((size - 1) % entry.stride != 0)
      throw InputError("stride", entry.stride, fmt::format("a divisor of grid - 1 = {} is required", size - 1));
  }
  const auto speeds = experiment.at("v_0").get<std::vector<double>>();
  const auto per_speed = static_cast<std::size_t>(size), n = speeds.size() * per_speed;
  const auto row_of = [&](std::size_t k) { return static_cast<int>(k % per_speed); };
  Progress progress(experiment.at("id").get<std::string>());
  file.sessions<RampGrid>(
      n, [&](std::size_t k) { return entries_in_row(entries, row_of(k)).size(); },
      [&](std::size_t k) {
        return run_row(entries_in_row(entries, row_of(k)), speeds[k / per_speed], size, row_of(k), T, with_times);
      },
      [&](std::size_t k) {
        progress.update(static_cast<double>(k + 1) / static_cast<double>(n),
                        fmt::format("v_0 = {}", speeds[k / per_speed]));
      });
  if (!experiment.contains("facets")) return;
  const json& facets = experiment["facets"];
  const json& with_polygon = facets.at("methods");
  const auto run_polygon = [&](std::size_t k) {
    return run_facets(with_polygon[k], facets.at("directions"), facets.at("load"), T);
  };
  file.each<RampFacets>(with_polygon.size(), run_polygon,
                        [&](std::size_t k) { progress.update(1, with_polygon[k].at("method")); });
}

void show_friction_ramp(const Results& results, Section& section) {
  const auto grids = whole_grids(results.all<RampGrid>());
  const auto facets = results.all<RampFacets>();
  const std::string id = results.experiment();
  if (!grids.empty()) {
    section.chart(ramp_chart(grids, id));
    section.result("methods", ramp_table(grids));
  }
  if (!facets.empty()) {
    section.chart(ramp_facets_chart(facets, id + "_facets"));
    section.result("polygons", ramp_facets_table(facets));
  }
}

constexpr const char* kFrictionRampFields = R"~({
  "required": ["grid", "duration", "v_0", "methods"],
  "properties": {
    "grid": {"type": "integer", "minimum": 2, "description": "Friction coefficients, and slopes, from 0 to 1.", "examples": [33]},
    "duration": {"type": "number", "exclusiveMinimum": 0, "description": "Of a run [s].", "examples": [0.5]},
    "v_0": {"type": "array", "items": {"type": "number"}, "description": "Initial velocities down the ramp [m/s].", "examples": [[0, -1]]},
    "methods": {
      "anyOf": [
        {"type": "string", "enum": ["all"]},
        {"type": "array", "items": {"type": "object", "additionalProperties": false, "required": ["method"], "properties": {
          "method": {"$ref": "#/$defs/method", "examples": ["moreau_jean"]},
          "steps": {"type": "integer", "minimum": 1, "description": "Of a fixed-step method.", "examples": [100]},
          "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Of an error-controlled method.", "examples": [1e-8]},
          "stride": {"type": "integer", "minimum": 1, "description": "Every so many points of the grid; a divisor of grid - 1.", "examples": [2]}}}}],
      "description": "Methods with one setting each, or \"all\": those of the program with the settings of others.", "examples": ["all"]},
    "others": {"type": "object", "additionalProperties": false, "description": "Also the methods that are not named, with these settings.", "examples": [{"steps": 100, "tolerance": 1e-8}], "properties": {
      "steps": {"type": "integer", "minimum": 1, "description": "Of fixed-step methods.", "examples": [100]},
      "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Tolerance of error-controlled methods.", "examples": [1e-8]}}},
    "facets": {"type": "object", "additionalProperties": false, "required": ["directions", "load", "methods"], "description": "Polygons in place of the friction disc, on ramps in space.", "properties": {
      "directions": {"type": "integer", "minimum": 2, "description": "Ways down in a quarter of a turn.", "examples": [31]},
      "load": {"type": "number", "exclusiveMinimum": 0, "description": "tan(slope) / mu where the direction of slip is measured.", "examples": [1.1]},
      "methods": {"type": "array", "description": "Methods with one setting each.", "items": {"type": "object", "additionalProperties": false, "required": ["method", "facets"], "properties": {
        "method": {"$ref": "#/$defs/method", "examples": ["moreau_jean,facets=4"]},
        "facets": {"type": "integer", "minimum": 0, "description": "Of its polygon; 0 for a disc.", "examples": [4]},
        "steps": {"type": "integer", "minimum": 1, "description": "Of a fixed-step method.", "examples": [50]},
        "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Of an error-controlled method.", "examples": [1e-8]}}}}}}
  }
})~";

// A method that fails, or declines, on a ramp is what the study is about.
const bool friction_ramp_is_registered =
    register_study({.kind = "friction_ramp",
                    .summary = "does a block on a ramp stick, and where does it slip with a polygon as friction cone",
                    .fields = kFrictionRampFields,
                    .rows = {RampGrid::kKind, RampFacets::kKind},
                    .times = Times::in_rows,
                    .name_methods = name_methods,
                    .run = run_friction_ramp,
                    .show = show_friction_ramp,
                    .unexpected_failures = {}});

}  // namespace

ExactRamp::State ExactRamp::at(double t) const {
  const double cosine = 1 / std::sqrt(1 + tangent * tangent);
  State s{0, v_0};
  for (int phase = 0; phase < 2; ++phase) {   // up or down to a stop, and then down
    if (s.v == 0 && tangent <= mu) return s;  // (2)
    const double direction = s.v < 0 ? -1 : 1;
    const double a = g * cosine * (tangent - mu * direction);  // (1)
    const double until_stop = s.v * a < 0 ? -s.v / a : std::numeric_limits<double>::infinity();
    const double dt = std::min(t, until_stop);
    s.x += dt * (s.v + 0.5 * a * dt);
    s.v = until_stop <= t ? 0 : s.v + a * dt;
    t -= dt;
    if (t <= 0) break;
  }
  return s;
}

double ExactFacets::limit() const {
  if (facets == 0) return 1;
  const double edge = std::numbers::pi / facets;
  const double psi = std::remainder(direction - edge, 2 * edge);  // normals of edges are at odd multiples of pi/F
  return std::cos(edge) / std::cos(psi);                          // (4)
}

std::array<double, 2> ExactFacets::drift(double load) const {
  const std::array<double, 2> x{load * std::cos(direction), load * std::sin(direction)};
  if (load <= limit()) return {0, 0};
  if (facets == 0) return {x[0] * (1 - 1 / load), x[1] * (1 - 1 / load)};
  std::array<double, 2> nearest{};
  double distance = std::numeric_limits<double>::infinity();
  for (int f = 0; f < facets; ++f) {  // of the points of all edges
    const auto a = facet_direction(2, f, facets), b = facet_direction(2, (f + 1) % facets, facets);
    const std::array<double, 2> along{b[0] - a[0], b[1] - a[1]};
    const double part = std::clamp(
        ((x[0] - a[0]) * along[0] + (x[1] - a[1]) * along[1]) / (along[0] * along[0] + along[1] * along[1]), 0.0, 1.0);
    const std::array<double, 2> rest{x[0] - a[0] - part * along[0], x[1] - a[1] - part * along[1]};
    if (const double d = std::hypot(rest[0], rest[1]); d < distance) {
      distance = d;
      nearest = rest;
    }
  }
  return nearest;  // (3)
}

}  // namespace ricochet
