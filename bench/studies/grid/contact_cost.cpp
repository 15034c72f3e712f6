#include "bench/studies/grid/contact_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "bench/experiment/study.h"
#include "bench/measure/measure_run.h"
#include "bench/measure/timing.h"
#include "bench/rows/progress.h"
#include "methods/registry.h"

namespace ricochet {
namespace {

constexpr double kDuration = 0.05;  // [s]; a box on an edge falls for longer
constexpr int kSteps = 100;
// [m] above the plane; time stepping lets corners sink by far less, and the next corner is far higher.
constexpr double kOnPlane = 1e-3;

/// Parameters that put the lowest corner of the tilted box on the plane.
ParameterChanges on_plane(double alpha, double beta, ParameterChanges scene) {
  constexpr double a = 0.15, b = 0.1, c = 0.05;
  scene["a"] = a;
  scene["b"] = b;
  scene["c"] = c;
  scene["alpha0"] = alpha;
  scene["beta0"] = beta;
  scene["height"] = a * std::cos(alpha) * std::sin(beta) + b * std::sin(alpha) + c * std::cos(alpha) * std::cos(beta);
  return scene;
}

int corners_on_plane(const Problem& problem, const Vector& q) {
  return static_cast<int>((problem.gap(q).array() < kOnPlane).count());
}

}  // namespace

std::vector<BoxMotion> box_motions() {
  std::vector<BoxMotion> motions;
  for (const bool has_friction : {false, true}) {
    for (const double speed : {1.0, 0.0}) {
      const bool sticks = speed == 0;
      if (sticks && !has_friction) continue;
      const std::string name = !has_friction ? "slide without friction" : sticks ? "stick" : "slide";
      const ParameterChanges scene = {{"mu", !has_friction ? 0
                                             : sticks      ? 2
                                                           : 0.3},
                                      {"e", 0},
                                      {"gamma0", 0},
                                      {"v_x0", speed},
                                      {"v_y0", 0},
                                      {"d_alpha0", 0},
                                      {"d_beta0", 0},
                                      {"d_gamma0", 0},
                                      {"duration", kDuration}};
      ParameterChanges flight = on_plane(0.5, 0.3, scene);
      flight["height"] += 1;
      motions.push_back({name, 0, flight});
      motions.push_back({name, 1, on_plane(0.5, 0.3, scene)});
      motions.push_back({name, 2, on_plane(0.5, 0, scene)});
      motions.push_back({name, 4, on_plane(0, 0, scene)});
    }
  }
  return motions;
}

std::vector<Run> measure_contact_cost(const std::vector<std::string>& methods, bool quick) {
  std::vector<Run> runs;
  std::vector<std::unique_ptr<Problem>> problems;
  std::vector<TimedRun> timed;
  std::vector<std::size_t> timed_rows;
  for (const std::string& method : methods) {
    for (const BoxMotion& motion : box_motions()) {
      const ProblemChoice choice{.problem = "box_3d", .parameters = motion.scene};
      const Problem& problem = *problems.emplace_back(choice.make_problem());
      Run& run = runs.emplace_back(planned_run(choice, method, {.steps = kSteps}));
      run.scene = motion.name;
      run.conditions["closed"] = motion.closed;
      const Solution solution = measure_run({.problem = problem}, run);
      if (!run.succeeded()) continue;
      if (const int closed = corners_on_plane(problem, solution.q); closed != motion.closed) {
        run.status = "other corners";
        run.message = fmt::format("{} corners on the plane at the end", closed);
        continue;
      }
      timed_rows.push_back(runs.size() - 1);
      timed.push_back(timed_run({.problem = problem}, run));
    }
  }
  Progress progress("cost of contacts");
  const auto timings = time_runs(timed, quick, [&](double share) { progress.update(share, "random order"); });
  for (std::size_t k = 0; k < timings.size(); ++k) runs[timed_rows[k]].timing = timings[k];
  return runs;
}

Table contact_cost_table(const std::vector<Run>& costs) {
  struct Line {
    std::string method, motion;
    std::map<int, double> times;  // [us] by corners

    double time(int corners) const {
      const auto found = times.find(corners);
      return found == times.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
    }
    double per_contact(int corners) const { return (time(corners) - time(0)) / corners; }
  };
  static const std::vector<Column<Line>> columns = {
      {"method", &Line::method},
      {"corners", &Line::motion},
      {"none", "", "{:.2f}", [](const Line& l) { return l.time(0); }},
      {"1", "", "{:.2f}", [](const Line& l) { return l.time(1); }},
      {"2", "", "{:.2f}", [](const Line& l) { return l.time(2); }},
      {"4", "", "{:.2f}", [](const Line& l) { return l.time(4); }},
      {"per contact", "", "{:.2f}", [](const Line& l) { return l.per_contact(2); }},
      {"per contact of 4", "", "{:.2f}", [](const Line& l) { return l.per_contact(4); }},
  };
  std::vector<Line> lines;
  for (const auto& cost : costs) {
    if (lines.empty() || lines.back().method != cost.method || lines.back().motion != cost.scene)
      lines.push_back({cost.method, cost.scene, {}});
    if (cost.succeeded())
      lines.back().times[static_cast<int>(cost.condition("closed"))] = 1e6 * cost.timing.median / kSteps;
  }
  return table_of(
      "Time of a step over the number of active contacts, in us", columns, lines,
      fmt::format(
          "Scene box_3d, {} steps in {} s: the box flies, or stands on a corner, an edge or a "
          "face. Median CPU time, all runs in random order. Per contact: half of the additional time of the edge over "
          "the flight, and a quarter of that of the face, whose forces are redundant.",
          kSteps, kDuration));
}

namespace {

void run_contact_cost(const nlohmann::json& experiment, ResultsFile& file) {
  const auto methods = experiment.at("methods").get<std::vector<std::string>>();
  for (const auto& method : methods) require_kind_of_setting(*make_method(method), "methods, which have steps", "");
  const std::size_t n = methods.size() * box_motions().size();
  file.rows<Run>(n, [&] { return measure_contact_cost(methods, experiment.value("quick", false)); });
}

std::vector<Run> failed_costs(const std::vector<Run>& costs) {
  return rows_where(costs, [](const auto& cost) { return !cost.succeeded(); });
}

void show_contact_cost(const Results& results, Section& section) {
  using C = Run;
  static const std::vector<Column<C>> columns = {
      {"method", &C::method},
      {"motion", &C::scene},
      {"corners", "", "{}", [](const C& c) { return c.condition("closed"); }},
      {"status", &C::status},
      {"reason", &C::message},
  };
  const auto costs = results.all<Run>();
  section.result("times", contact_cost_table(costs));
  section.failures("failures", table_of("Runs without a time", columns, failed_costs(costs)));
}

constexpr const char* kContactCostFields = R"~({
  "required": ["methods"],
  "properties": {
    "methods": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}, "description": "Fixed-step methods.", "examples": [["moreau_jean"]]}
  }
})~";

const bool contact_cost_is_registered = register_study(
    {.kind = "contact_cost",
     .summary = "the time of a step of a box in space per active contact",
     .fields = kContactCostFields,
     .rows = {Run::kKind},
     .reads_quick = true,
     .run = run_contact_cost,
     .show = show_contact_cost,
     .unexpected_failures = [](const Results& r) { return static_cast<int>(failed_costs(r.all<Run>()).size()); }});

}  // namespace
}  // namespace ricochet
