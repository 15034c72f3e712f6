#include "reports/control_growth.h"

#include <fmt/format.h>

#include <algorithm>

namespace ricochet {
namespace {

using nlohmann::json;

std::string milliseconds(double seconds) {
  return fmt::format("{:.3g}", 1e3 * seconds);
}

/// Of the solved runs from `first` up to before `last`, which are of one problem.
std::vector<std::string> exponents(const std::vector<ControlGrowth>& runs, std::size_t first, std::size_t last) {
  std::vector<double> N, variables, iterations, derivatives, rest, seconds, again_N, again;
  for (std::size_t i = first; i < last; ++i) {
    const ControlGrowth& run = runs[i];
    if (!run.succeeded()) continue;
    N.push_back(run.intervals);
    variables.push_back(run.variables);
    iterations.push_back(run.iterations);
    derivatives.push_back(run.derivative_seconds / run.iterations);
    rest.push_back((run.seconds - run.derivative_seconds) / run.iterations);
    seconds.push_back(run.seconds);
    if (run.again_status != "success" || !run.again_kept_branch) continue;
    again_N.push_back(run.intervals);
    again.push_back(run.again_seconds);
  }
  return {runs[first].problem,
          fmt::format("{} solved", N.size()),
          growth_text("N", N, variables),
          "",
          growth_text("N", N, iterations),
          growth_text("N", N, derivatives),
          growth_text("N", N, rest),
          growth_text("N", N, seconds),
          "fit",
          "",
          growth_text("N", again_N, again),
          ""};
}

}  // namespace

json to_json(const ControlGrowth& g) {
  json steps = json::array();
  for (const auto& step : g.steps)
    steps.push_back({{"sigma", step.sigma},
                     {"iterations", step.iterations},
                     {"seconds", step.seconds},
                     {"complementarity", step.complementarity},
                     {"is_solved", step.is_solved}});
  return {{"kind", "control_growth"},
          {"problem", g.problem},
          {"command", g.command},
          {"intervals", g.intervals},
          {"variables", g.variables},
          {"pairs", g.pairs},
          {"status", g.status},
          {"message", g.message},
          {"iterations", g.iterations},
          {"seconds", g.seconds},
          {"derivative_seconds", g.derivative_seconds},
          {"steps", steps},
          {"again_status", g.again_status},
          {"again_kept_branch", g.again_kept_branch},
          {"again_iterations", g.again_iterations},
          {"again_seconds", g.again_seconds}};
}

ControlGrowth control_growth_from_json(const json& j) {
  ControlGrowth g;
  j.at("problem").get_to(g.problem);
  j.at("command").get_to(g.command);
  j.at("intervals").get_to(g.intervals);
  j.at("variables").get_to(g.variables);
  j.at("pairs").get_to(g.pairs);
  j.at("status").get_to(g.status);
  j.at("message").get_to(g.message);
  j.at("iterations").get_to(g.iterations);
  j.at("seconds").get_to(g.seconds);
  j.at("derivative_seconds").get_to(g.derivative_seconds);
  for (const auto& step : j.at("steps"))
    g.steps.push_back({step.at("sigma"), step.at("iterations"), step.at("seconds"), step.at("complementarity"),
                       step.at("is_solved")});
  j.at("again_status").get_to(g.again_status);
  j.at("again_kept_branch").get_to(g.again_kept_branch);
  j.at("again_iterations").get_to(g.again_iterations);
  j.at("again_seconds").get_to(g.again_seconds);
  return g;
}

Table growth_table(const std::vector<ControlGrowth>& runs) {
  Table table;
  table.title = "Growth of the work with the number of control intervals";
  table.columns = {{"problem", true},
                   {"N"},
                   {"variables"},
                   {"pairs"},
                   {"iterations"},
                   {"derivatives [ms/it.]"},
                   {"linear solver and rest [ms/it.]"},
                   {"seconds"},
                   {"status", true},
                   {"again", true},
                   {"again [s]"},
                   {"again, iterations"}};
  table.note =
      "Seconds: homotopy and crossover, wall time, without the guess. Again: the plant has run one interval, was "
      "moved, "
      "and the rest is planned from there; by the same branch, or by a homotopy where that has no solution. The lines "
      "of exponents are fits over the solved runs, those of \"again\" over the ones that kept the branch.";
  std::size_t first = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const ControlGrowth& run = runs[i];
    const double iterations = std::max(run.iterations, 1);
    const bool is_again = run.again_status == "success";
    table.rows.push_back({run.problem, fmt::format("{}", run.intervals), fmt::format("{}", run.variables),
                          fmt::format("{}", run.pairs), fmt::format("{}", run.iterations),
                          milliseconds(run.derivative_seconds / iterations),
                          milliseconds((run.seconds - run.derivative_seconds) / iterations),
                          fmt::format("{:.2f}", run.seconds), run.status,
                          !is_again               ? (run.again_status.empty() ? "-" : run.again_status)
                          : run.again_kept_branch ? "branch"
                                                  : "homotopy",
                          is_again ? fmt::format("{:.3f}", run.again_seconds) : "-",
                          is_again ? fmt::format("{}", run.again_iterations) : "-"});
    if (i + 1 < runs.size() && runs[i + 1].problem == run.problem) continue;
    if (i > first) table.rows.push_back(exponents(runs, first, i + 1));
    first = i + 1;
  }
  return table;
}

std::vector<GrowthCurve> growth_curves(const std::vector<ControlGrowth>& runs) {
  std::vector<GrowthCurve> curves;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == 0 || runs[i].problem != runs[i - 1].problem) {
      for (const char* panel : {"of an iteration", "of a re-solve on the same branch"})
        curves.push_back({panel, runs[i].problem, {}});
    }
    const ControlGrowth& run = runs[i];
    if (!run.succeeded()) continue;
    const auto last = curves.end() - 2;
    last->points.emplace_back(run.intervals, run.seconds / std::max(run.iterations, 1));
    if (run.again_status == "success" && run.again_kept_branch)
      (last + 1)->points.emplace_back(run.intervals, run.again_seconds);
  }
  return curves;
}

Table homotopy_steps(const std::vector<ControlGrowth>& runs) {
  Table table;
  table.title = "Steps of the homotopies";
  table.columns = {{"problem", true}, {"N"},           {"sigma"}, {"iterations"}, {"seconds"},
                   {"max min(G, H)"}, {"solved", true}};
  table.note = "What a run took more than its steps is the crossover to exact complementarity.";
  for (const auto& run : runs) {
    for (const auto& step : run.steps)
      table.rows.push_back({run.problem, fmt::format("{}", run.intervals), fmt::format("{:.1e}", step.sigma),
                            fmt::format("{}", step.iterations), fmt::format("{:.2f}", step.seconds),
                            fmt::format("{:.1e}", step.complementarity), step.is_solved ? "yes" : "no"});
  }
  return table;
}

}  // namespace ricochet
