#include "reports/scale_results.h"

#include <fmt/format.h>

#include <cmath>

namespace ricochet {
namespace {

using nlohmann::json;

bool same_curve(const ScaleRun& a, const ScaleRun& b) {
  return a.scene == b.scene && a.method == b.method;
}

/// Of the runs from `first` up to before `last`. Time is fitted where the contacts outweigh what every step has.
std::vector<std::string> exponents(const std::vector<ScaleRun>& runs, std::size_t first, std::size_t last) {
  std::vector<double> n, time, iterations;
  for (std::size_t i = first; i < last; ++i) {
    if (!runs[i].succeeded() || runs[i].active == 0) continue;
    n.push_back(runs[i].active);
    time.push_back(runs[i].step_seconds);
    iterations.push_back(runs[i].iterations);
  }
  const bool has_iterations = std::ranges::all_of(iterations, [](double x) { return x > 0; });
  return {runs[first].scene,
          runs[first].method,
          "",
          "",
          fmt::format("fit of {}", n.size()),
          growth_text("n", n, time),
          "",
          "",
          has_iterations ? growth_text("n", n, iterations) : "-"};
}

}  // namespace

json to_json(const ScaleRun& r) {
  return {{"kind", "scale_run"},
          {"scene", r.scene},
          {"method", r.method},
          {"command", r.command},
          {"size", r.size},
          {"contacts", r.contacts},
          {"active", r.active},
          {"steps", r.steps},
          {"status", r.status},
          {"message", r.message},
          {"step_seconds", r.step_seconds},
          {"solves", r.solves},
          {"iterations", r.iterations},
          {"events", r.events}};
}

ScaleRun scale_run_from_json(const json& j) {
  ScaleRun r;
  j.at("scene").get_to(r.scene);
  j.at("method").get_to(r.method);
  j.at("command").get_to(r.command);
  j.at("size").get_to(r.size);
  j.at("contacts").get_to(r.contacts);
  j.at("active").get_to(r.active);
  j.at("steps").get_to(r.steps);
  j.at("status").get_to(r.status);
  j.at("message").get_to(r.message);
  j.at("step_seconds").get_to(r.step_seconds);
  j.at("solves").get_to(r.solves);
  j.at("iterations").get_to(r.iterations);
  r.events = j.value("events", 0);  // earlier results do not say
  return r;
}

Table scale_table(const std::vector<ScaleRun>& runs) {
  Table table;
  table.title = "Time of a step over the number of active contacts";
  table.columns = {{"scene", true}, {"method", true}, {"bodies"},          {"possible contacts"},  {"active"},
                   {"us per step"}, {"events"},       {"solves per step"}, {"iterations per step"}};
  table.note =
      "CPU time, median; of runs of over 2 s, one. Active: contacts that touch at the end. Solves: contact problems, "
      "or systems of Newton's "
      "method; iterations: inner ones and pivots. The lines of exponents are fits over the runs that succeeded.";
  std::size_t first = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const ScaleRun& run = runs[i];
    if (run.succeeded())
      table.rows.push_back({run.scene, run.method, fmt::format("{}", run.size), fmt::format("{}", run.contacts),
                            fmt::format("{}", run.active), fmt::format("{:.3g}", 1e6 * run.step_seconds),
                            fmt::format("{}", run.events), fmt::format("{:.3g}", run.solves),
                            fmt::format("{:.3g}", run.iterations)});
    if (i + 1 < runs.size() && same_curve(run, runs[i + 1])) continue;
    table.rows.push_back(exponents(runs, first, i + 1));
    first = i + 1;
  }
  return table;
}

Table scale_failures(const std::vector<ScaleRun>& runs) {
  Table table;
  table.title = "Runs without a result";
  table.columns = {{"scene", true}, {"bodies"}, {"method", true}, {"status", true}, {"reason", true}};
  for (const auto& run : runs) {
    if (!run.succeeded())
      table.rows.push_back({run.scene, fmt::format("{}", run.size), run.method, run.status, run.message});
  }
  return table;
}

std::vector<GrowthCurve> scale_curves(const std::vector<ScaleRun>& runs) {
  std::vector<GrowthCurve> curves;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == 0 || !same_curve(runs[i - 1], runs[i])) curves.push_back({runs[i].scene, runs[i].method, {}});
    if (runs[i].succeeded() && runs[i].active > 0)
      curves.back().points.emplace_back(runs[i].active, 1e6 * runs[i].step_seconds);
  }
  return curves;
}

}  // namespace ricochet
