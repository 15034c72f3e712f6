#include "bench/studies/contact_cost.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <stdexcept>

#include "bench/progress.h"
#include "bench/timing.h"
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

Table contact_cost(const std::vector<std::string>& methods, bool quick) {
  const std::vector<BoxMotion> motions = box_motions();
  std::vector<std::unique_ptr<Problem>> problems;
  for (const BoxMotion& motion : motions) problems.push_back(make_problem("box_3d", motion.scene));

  std::vector<TimedRun> runs;
  for (const std::string& spec : methods) {
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const std::shared_ptr<const Method> method = make_method(spec);
      Settings settings;
      settings.steps = kSteps;
      const Problem& problem = *problems[k];
      const Solution solution = method->solve(problem, settings);
      const std::string run = fmt::format("{}: {} corners {}", spec, motions[k].closed, motions[k].name);
      if (!solution.succeeded()) throw std::runtime_error(fmt::format("{}: {}", run, solution.message));
      const int closed = corners_on_plane(problem, solution.q);
      if (closed != motions[k].closed) throw std::runtime_error(fmt::format("{}: {} at the end", run, closed));
      runs.push_back({run, 0, [method, settings, &problem] { method->solve(problem, settings); }});
    }
  }
  Progress progress("cost of contacts");
  const std::vector<Timing> timings =
      measure(runs, quick, [&](double share) { progress.update(share, "random order"); });
  progress.finish();

  Table table;
  table.title = "Time of a step over the number of active contacts, in us";
  table.columns = {{"method", true}, {"corners", true},   {"none"}, {"1"}, {"2"}, {"4"},
                   {"per contact"},  {"per contact of 4"}};
  std::size_t next = 0;
  for (const std::string& spec : methods) {
    std::map<std::string, std::map<int, double>> times;  // [us]
    for (const BoxMotion& motion : motions) times[motion.name][motion.closed] = timings[next++].median * 1e6 / kSteps;
    for (auto& [name, time] : times) {
      table.rows.push_back({spec, name, fmt::format("{:.2f}", time[0]), fmt::format("{:.2f}", time[1]),
                            fmt::format("{:.2f}", time[2]), fmt::format("{:.2f}", time[4]),
                            fmt::format("{:.2f}", (time[2] - time[0]) / 2),
                            fmt::format("{:.2f}", (time[4] - time[0]) / 4)});
    }
  }
  table.note = fmt::format(
      "Scene box_3d, {} steps in {} s: the box flies, or stands on a corner, an edge or a face. Median CPU time, all "
      "runs in random order. Per contact: what the edge adds to the flight, halved; what the face adds, over four: its "
      "forces are redundant.",
      kSteps, kDuration);
  return table;
}

}  // namespace ricochet
