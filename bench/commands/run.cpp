#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>

#include "bench/commands.h"
#include "bench/problem_options.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/figures.h"

namespace ricochet {
namespace {

struct Options {
  ProblemOptions problem;
  std::string method;
  std::string plot;
  bool with_reference = false;
};

std::string numbers(const Vector& x) {
  return fmt::format("{:.15g}", fmt::join(x.begin(), x.end(), "  "));
}

void print_solution(const Problem& problem, const Solution& solution, double seconds) {
  const auto& info = problem.info();
  fmt::print("status     {}{}\n", to_string(solution.status), solution.message.empty() ? "" : ": " + solution.message);
  fmt::print("t          {:.15g} of {:.15g} s\nq          {}\nv          {}\n", solution.t, info.end_time,
             numbers(solution.q), numbers(solution.v));
  const auto before = problem.energy(info.q0, info.v0), after = problem.energy(solution.q, solution.v);
  if (before && after) fmt::print("energy     {:.12g} J, {:+.3g} J since the start\n", *after, *after - *before);
  if (!solution.events.empty()) {
    fmt::print("events     {}\n", solution.events.size());
    const std::size_t shown = std::min<std::size_t>(solution.events.size(), 20);
    for (std::size_t k = 0; k < shown; ++k) {
      const Event& e = solution.events[k];
      fmt::print("  {:<8} t = {:.15g}  {}{}\n", to_string(e.kind), e.t, info.contacts[e.contact].name,
                 e.kind == EventKind::impact ? fmt::format("  Lambda_n = {:.6g} N s", e.Lambda_n[e.contact]) : "");
    }
    if (shown < solution.events.size()) fmt::print("  and {} more\n", solution.events.size() - shown);
  }
  const Counters& c = solution.counters;
  fmt::print(
      "work       {} steps, {} elements, {} force evaluations, {} Newton iterations, {} factorizations, {} contact "
      "problems\n",
      c.steps, c.elements, c.force_evaluations, c.inner_iterations, c.matrix_factorizations, c.complementarity_solves);
  fmt::print("wall time  {:.3f} ms{}\n", seconds * 1e3,
             c.steps > 0 ? fmt::format(", {:.3f} us a step (one run, not a benchmark)",
                                       seconds * 1e6 / static_cast<double>(c.steps))
                         : "");
}

Trajectory trajectory_of(const Problem& problem, const std::string& method, const Solution& solution) {
  Trajectory trajectory{problem.info().id, method, {}, {}, {}};
  for (const auto& sample : solution.samples) {
    for (const Vector* v : {&sample.v_minus, &sample.v_plus}) {
      trajectory.t.push_back(sample.t);
      trajectory.q.emplace_back(sample.q.begin(), sample.q.end());
      trajectory.v.emplace_back(v->begin(), v->end());
    }
  }
  return trajectory;
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  static Options options;
  auto* command = app.add_subcommand("run", "one method on one problem");
  options.problem.add_problem(*command);
  options.problem.add_settings(*command);
  command->add_option("--method,-m", options.method, "method, see `ricochet list methods`")->required();
  command->add_option("--plot", options.plot, "FOLDER for a figure of the motion (trajectory.svg)");
  command->callback([&exit_code] {
    const auto problem = options.problem.make_problem();
    const auto method = make_method(options.method);
    Settings settings = options.problem.settings(*problem);
    if (!options.plot.empty()) {
      if (!can_draw()) throw InputError("--plot", options.plot, "gnuplot is needed for figures and was not found");
      settings.recording = Recording::grid;
    }
    const auto begin = std::chrono::steady_clock::now();
    const Solution solution = method->solve(*problem, settings);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    fmt::print("problem    {}: {}\nmethod     {}: {}\n", problem->info().id, problem->info().title, options.method,
               method->info().title);
    print_solution(*problem, solution, seconds);
    if (!options.plot.empty() && !solution.samples.empty()) {
      const auto figure =
          FigureFolder(options.plot).trajectory(trajectory_of(*problem, options.method, solution), "trajectory");
      fmt::print("figure     {}/{}\n", options.plot, figure.file);
    }
    if (!solution.succeeded()) exit_code = 1;
  });
}

}  // namespace ricochet
