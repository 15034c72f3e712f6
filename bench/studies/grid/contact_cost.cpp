#include "bench/studies/grid/contact_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "bench/measure/setting_kind.h"
#include "bench/measure/timing.h"
#include "bench/rows/progress.h"
#include "bench/studies/study.h"
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

namespace {

/// Solves once, and says what went wrong: no success, or other corners on the plane than the motion promises.
ContactCost try_motion(const Method& method, const std::string& spec, const BoxMotion& motion, const Problem& problem,
                       const Settings& settings) {
  ContactCost cost{.method = spec, .motion = motion.name, .closed = motion.closed, .status = {}, .message = {}};
  if (const Support support = method.can_run(problem.info()); !support.ok) {
    cost.status = "declined";
    cost.message = support.reason;
    return cost;
  }
  const Solution solution = method.solve(problem, settings);
  cost.status = to_string(solution.status);
  cost.message = solution.message;
  if (!solution.succeeded()) return cost;
  if (const int closed = corners_on_plane(problem, solution.q); closed != motion.closed) {
    cost.status = "other corners";
    cost.message = fmt::format("{} corners on the plane at the end", closed);
  }
  return cost;
}

}  // namespace

std::vector<ContactCost> measure_contact_cost(const std::vector<std::string>& methods, bool quick) {
  Settings settings;
  settings.steps = kSteps;
  std::vector<ContactCost> costs;
  std::vector<TimedRun> runs;
  std::vector<std::size_t> timed;  // the cost of each run
  for (const std::string& spec : methods) {
    const std::shared_ptr<const Method> method = make_method(spec);
    for (const BoxMotion& motion : box_motions()) {
      const std::shared_ptr<const Problem> problem = make_problem("box_3d", motion.scene);
      costs.push_back(try_motion(*method, spec, motion, *problem, settings));
      if (!costs.back().succeeded()) continue;
      timed.push_back(costs.size() - 1);
      runs.push_back({fmt::format("{}: {} corners {}", spec, motion.closed, motion.name), 0,
                      [method, settings, problem] { return method->solve(*problem, settings).own_seconds; }});
    }
  }
  Progress progress("cost of contacts");
  const std::vector<Timing> timings =
      measure(runs, quick, [&](double share) { progress.update(share, "random order"); });
  for (std::size_t k = 0; k < timed.size(); ++k) costs[timed[k]].step_seconds = timings[k].median / kSteps;
  return costs;
}

Table contact_cost_table(const std::vector<ContactCost>& costs) {
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
    if (lines.empty() || lines.back().method != cost.method || lines.back().motion != cost.motion)
      lines.push_back({cost.method, cost.motion, {}});
    if (cost.succeeded()) lines.back().times[cost.closed] = 1e6 * cost.step_seconds;
  }
  return table_of("Time of a step over the number of active contacts, in us", columns, lines,
                  fmt::format("Scene box_3d, {} steps in {} s: the box flies, or stands on a corner, an edge or a "
                              "face. Median CPU time, all runs in random order. Per contact: what the edge adds to "
                              "the flight, halved; what the face adds, over four: its forces are redundant.",
                              kSteps, kDuration));
}

namespace {

void run_contact_cost(const nlohmann::json& experiment, ResultsFile& file) {
  const auto methods = experiment.at("methods").get<std::vector<std::string>>();
  for (const auto& method : methods) require_kind_of_setting(*make_method(method), "methods, which have steps", "");
  const std::size_t n = methods.size() * box_motions().size();
  file.rows<ContactCost>(n, [&] { return measure_contact_cost(methods, experiment.value("quick", false)); });
}

std::vector<ContactCost> failed_costs(const std::vector<ContactCost>& costs) {
  std::vector<ContactCost> failed;
  std::ranges::copy_if(costs, std::back_inserter(failed), [](const auto& cost) { return !cost.succeeded(); });
  return failed;
}

void show_contact_cost(const Results& results, Section& section) {
  using C = ContactCost;
  static const std::vector<Column<C>> columns = {
      {"method", &C::method}, {"motion", &C::motion},  {"corners", "", "{}", &C::closed},
      {"status", &C::status}, {"reason", &C::message},
  };
  const auto costs = results.all<ContactCost>();
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
     .rows = {ContactCost::kKind},
     .reads_quick = true,
     .run = run_contact_cost,
     .show = show_contact_cost,
     .surprises = [](const Results& r) { return static_cast<int>(failed_costs(r.all<ContactCost>()).size()); }});

}  // namespace
}  // namespace ricochet
