#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <chrono>

#include "bench/commands.h"
#include "bench/problem_choice.h"
#include "bench/problem_options.h"
#include "bench/sensitivities.h"
#include "bench/studies/method_grid/grid_tables.h"
#include "bench/trajectory_of.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct RunArguments {
  ProblemOptions problem;
  std::string method;
  std::string plot, csv;
  int points = 1000;
  std::vector<std::string> sensitivities;
};

std::string numbers(const Eigen::Ref<const Vector>& x) {
  return fmt::format("{:.15g}", fmt::join(x.begin(), x.end(), "  "));
}

std::size_t shown_events(const Solution& solution) {
  return std::min<std::size_t>(solution.events.size(), 20);
}

void print_solution(const Problem& problem, const Solution& solution) {
  const auto& info = problem.info();
  fmt::print("status     {}{}\n", to_string(solution.status), solution.message.empty() ? "" : ": " + solution.message);
  fmt::print("t          {:.15g} of {:.15g} s\nq          {}\nv          {}\n", solution.t, info.end_time,
             numbers(solution.q.head(info.n_mechanical())), numbers(solution.v.head(info.n_mechanical())));
  const auto before = problem.energy(info.q0, info.v0), after = problem.energy(solution.q, solution.v);
  if (before && after) fmt::print("energy     {:.12g} J, {:+.3g} J since the start\n", *after, *after - *before);
  if (!solution.events.empty()) {
    fmt::print("events     {}\n", solution.events.size());
    const std::size_t shown = shown_events(solution);
    for (std::size_t k = 0; k < shown; ++k) {
      const Event& e = solution.events[k];
      fmt::print("  {:<8} t = {:.15g}  {}{}\n", to_string(e.kind), e.t, info.contacts[e.contact].name,
                 e.kind == EventKind::impact ? fmt::format("  Lambda_n = {:.6g} N s", e.Lambda_n[e.contact]) : "");
    }
    if (shown < solution.events.size()) fmt::print("  and {} more\n", solution.events.size() - shown);
  }
}

/// @param n_solutions  that took the time, all but one of them for differences
void print_work(const Counters& c, double seconds, std::size_t n_solutions) {
  fmt::print(
      "work       {} steps, {} elements, {} force evaluations, {} Newton iterations, {} factorizations, {} contact "
      "problems\n",
      c.steps, c.elements, c.force_evaluations, c.inner_iterations, c.matrix_factorizations, c.complementarity_solves);
  std::string cost;
  if (n_solutions > 1)
    cost = fmt::format(", for {} solutions", n_solutions);
  else if (c.steps > 0)
    cost = fmt::format(", {:.3f} us a step (one run, not a benchmark)", seconds * 1e6 / static_cast<double>(c.steps));
  fmt::print("wall time  {:.3f} ms{}\n", seconds * 1e3, cost);
}

/// @param by_differences  whether the method has none itself
void print_sensitivities(const std::vector<std::string>& names, const ProblemInfo& info, const Solution& solution,
                         bool by_differences) {
  const int n = info.n_mechanical();
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    Vector dt(static_cast<Eigen::Index>(shown_events(solution)));
    for (Eigen::Index e = 0; e < dt.size(); ++e) dt[e] = solution.events[static_cast<std::size_t>(e)].dt[column];
    fmt::print("d/d {}{}\n  dq       {}\n  dv       {}\n", names[k],
               by_differences ? ", by differences of its solution" : "", numbers(solution.dq.col(column).head(n)),
               numbers(solution.dv.col(column).head(n)));
    if (dt.size() > 0) fmt::print("  dt       {}\n", numbers(dt));
  }
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  static RunArguments options;
  auto* command = app.add_subcommand("run", "one method on one problem");
  options.problem.add_problem(*command);
  options.problem.add_settings(*command);
  command->add_option("--method,-m", options.method, "method, see `ricochet list methods`")->required();
  command->add_option("--plot", options.plot, "FOLDER for a figure of the motion (trajectory.svg)");
  auto* csv = command->add_option("--csv", options.csv, "FILE for the motion: t, q and v as CSV");
  command->add_option("--points", options.points, "of the CSV: equally spaced, besides the events")
      ->needs(csv)
      ->check(CLI::Range(1, 100'000'000));
  command->add_option("--sensitivity", options.sensitivities,
                      "print derivatives by q0:0 or v0:0, a component of the initial values, or by param:NAME, a "
                      "parameter; may be repeated");
  command->callback([&exit_code] {
    const auto problem = options.problem.make_problem();
    const auto method = make_method(options.method);
    Settings settings = options.problem.settings(*problem, *method);
    if (!options.plot.empty()) {
      if (!can_draw()) throw InputError("--plot", options.plot, "gnuplot is needed for figures and was not found");
    }
    if (!options.csv.empty()) require_writable("motion", options.csv);
    const bool wants_motion = !options.plot.empty() || !options.csv.empty();
    if (wants_motion) settings.recording = Recording::motion;
    settings.sensitivities = options.sensitivities;
    const bool by_differences = !settings.sensitivities.empty() && !method->info().has_sensitivities;
    const auto begin = std::chrono::steady_clock::now();
    const Solution solution = solve_with_sensitivities(*method, *problem, settings);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    fmt::print("problem    {}: {}\nmethod     {}: {}\n", problem->info().id, problem->info().title, options.method,
               method->info().title);
    print_solution(*problem, solution);
    if (solution.succeeded()) print_sensitivities(settings.sensitivities, problem->info(), solution, by_differences);
    print_work(solution.counters, seconds, by_differences ? 1 + 4 * settings.sensitivities.size() : 1);
    if (wants_motion && solution.motion.empty())
      throw InputError(
          fmt::format("method {} says nothing of the motion between its steps: there is nothing to draw or "
                      "to write",
                      options.method));
    if (!options.plot.empty()) {
      const std::string setting = setting_text(settings.steps, settings.tolerance);
      const auto figure = draw_trajectory(FigureFolder(options.plot),
                                          trajectory_of(*problem, options.method, setting, solution), "trajectory");
      fmt::print("figure     {}/{}\n", options.plot, figure.file);
    }
    if (!options.csv.empty()) {
      write_text("motion", options.csv, trajectory_csv(*problem, solution, options.points));
      fmt::print("motion     {}\n", options.csv);
    }
    if (!solution.succeeded()) exit_code = 1;
  });
}

}  // namespace ricochet
