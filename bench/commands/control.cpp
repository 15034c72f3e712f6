#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "bench/commands/commands.h"
#include "bench/control/control_claim.h"
#include "bench/control/control_guess.h"
#include "bench/control/replay.h"
#include "bench/studies/control/control_views.h"
#include "problems/control/controls_csv.h"
#include "problems/input_error.h"
#include "reports/render/gnuplot.h"
#include "reports/table.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct ControlArguments {
  ControlOptions control;
  bool no_replay = false, as_json = false;
  std::string plot, csv;
};

void print_step(const HomotopyStep& step) {
  fmt::print("  {:8.1e}  {:10}  {:12.6g}  {:8.1e}  {:8.1e}  {:7.2f}  {:5.1f} %{}\n", step.sigma, step.iterations,
             step.objective, step.complementarity, step.violation, step.seconds,
             step.seconds > 0 ? 100 * step.derivative_seconds / step.seconds : 0.0,
             is_solved(step.status) ? "" : "  not solved");
  std::fflush(stdout);
}

struct ReplayLine {
  std::string integrator;
  Replay replay;
  ReplayMismatch mismatch;  ///< of a replay that succeeded

  bool succeeded() const { return replay.status == Status::success; }
};

Table replay_table(const OptimalControlProblem& problem, const ControlTrajectory& trajectory) {
  using L = ReplayLine;
  static const std::vector<Column<L>> columns = {
      {"integrator", &L::integrator},
      {"status", [](const L& l) { return l.succeeded() ? "success" : l.replay.message; }},
      {"terminal", "", "{:.2e}", [](const L& l) { return when(l.succeeded(), l.mismatch.terminal); }},
      {"events", "s", "{}",
       [](const L& l) {
         if (!l.succeeded()) return std::string("-");
         return std::isfinite(l.mismatch.events) ? fmt::format("{:.2e}", l.mismatch.events) : "other";
       }},
      {"true cost", "", "{:.8g}", [](const L& l) { return when(l.succeeded(), l.replay.cost); }},
      {"minus claimed", "", "{:+.2e}", [](const L& l) { return when(l.succeeded(), l.mismatch.cost); }},
      {"penetration", "", "{:.1e}", [](const L& l) { return when(l.succeeded(), l.replay.penetration); }},
  };
  std::vector<L> lines;
  for (const auto& [name, solve] :
       {std::pair<const char*, IntervalSolver>{"reference, CVODE with events", reference_solver(1e-11)},
        {"FESD-J, pivoting, adaptive", pivoting_solver(1e-9)}}) {
    L line{name, replay(problem, trajectory, solve), {}};
    if (line.succeeded()) line.mismatch = mismatch(problem, trajectory, line.replay);
    lines.push_back(std::move(line));
  }
  return table_of(
      "Open-loop replay of the controls", columns, lines,
      "Mismatch: replay minus claim. Events: largest difference of impact times; other, when not the same contacts.");
}

void print_impulses(const OptimalControlProblem& problem, const ControlTrajectory& trajectory) {
  const double least = smallest_impact(problem, trajectory);
  for (const auto& impulse : trajectory.impulses) {
    if (impulse.Lambda_n > least)
      fmt::print("impact     t = {:.9g} s  {}  Lambda_n = {:.6g} N s\n", impulse.t,
                 problem.plant->info().contacts[impulse.contact].name, impulse.Lambda_n);
  }
}

/// States, controls and forces; frames and an animation where the problem has a geometry.
void draw(const OptimalControlProblem& problem, const ControlSolution& solution, const ControlOptions& options,
          const std::string& folder) {
  ControlRun run;
  run.method = options.method;
  run.problem = problem.id;
  run.title = problem.title;
  run.discretisation = options.describe(problem);
  run.status = to_string(Status::success);
  describe_claim(problem, solution, run);
  const FigureFolder figures(folder);
  fmt::print("figure     {}/{}\n", folder, draw_chart(figures, control_chart({run}, problem.id)).front().file);
  fmt::print("progress   {}/{}\n", folder,
             draw_chart(figures, progress_chart({run}, problem.id + "_progress")).front().file);
  if (!problem.plant->info().geometry) return;
  fmt::print("frames     {}/{}\n", folder, draw_frames(figures, problem, run, problem.id + "_frames").file);
  fmt::print("animation  {}/{}\n", folder, draw_scene(figures, problem, run, problem.id + "_scene").file);
}

void print_iteration(const ShootingIteration& at) {
  fmt::print("  {:9}  {:14.9g}  {:8.1e}  {:8.1e}  {:8.1e}  {:7.3f}{}{}\n", at.number, at.cost, at.violation, at.step,
             at.Delta, at.seconds, at.guarded ? "  guards" : "", at.same_sequence ? "" : "  other sequence");
  std::fflush(stdout);
}

void print_head(const ControlOptions& options, const PreparedMethod& method, const std::string& discretisation) {
  if (!method.transcription) {
    fmt::print("shooting   {}\n  {:>9}  {:>14}  {:>8}  {:>8}  {:>8}  {:>7}\n", discretisation, "iteration", "cost",
               "violated", "step", "region", "s");
    return;
  }
  const Mpcc& mpcc = method.transcription->mpcc();
  fmt::print("program    {}: {} variables, {} rows, {} complementarity pairs\n", discretisation, mpcc.nlp.n_variables(),
             mpcc.nlp.n_rows(), mpcc.pairs.size());
  fmt::print("homotopy   {}\n  {:>8}  {:>10}  {:>12}  {:>8}  {:>8}  {:>7}  derivatives\n", options.homotopy.relaxation,
             "sigma", "iterations", "objective", "G _|_ H", "violated", "s");
}

int solve_control_problem(const ControlArguments& options) {
  if (options.as_json) {  // excludes the other outputs
    const ControlRun run = solve_and_replay(options.control, {}, !options.no_replay);
    fmt::print("{}\n", nlohmann::json(run).dump(1, ' ', false, nlohmann::json::error_handler_t::replace));
    return run.succeeded() ? 0 : 1;
  }
  const auto problem = options.control.make_problem();
  if (!options.plot.empty() && !can_draw())
    throw InputError("--plot", options.plot, "gnuplot is needed for figures and was not found");
  if (!options.plot.empty()) require_writable_folder("--plot", options.plot);
  if (!options.csv.empty()) require_writable("controls", options.csv);
  const PreparedMethod method = prepared_method(options.control, *problem, {print_step, print_iteration});
  for (const auto& note : method.notes) fmt::print("{}\n", note);
  const std::string discretisation = options.control.describe(*problem);
  fmt::print("problem    {}: {}\n", problem->id, problem->title);
  print_head(options.control, method, discretisation);
  const ControlSolution solution = method.solver->solve();
  fmt::print("status     {}{}\n", to_string(solution.status), solution.message.empty() ? "" : ": " + solution.message);
  fmt::print("solved in  {:.3f} s, {} iterations{}, {:.0f} % in derivatives\n", solution.seconds, solution.iterations,
             solution.rollouts > 0 ? fmt::format(", {} rollouts", solution.rollouts) : "",
             solution.seconds > 0 ? 100 * solution.derivative_seconds / solution.seconds : 0.0);
  if (method.transcription) fmt::print("complement max min(G, H) = {:.1e}\n", solution.complementarity);
  if (!solution.violated.empty()) fmt::print("violated   {:.1e}, {}\n", solution.violation, solution.violated);
  if (!solution.stationarity.empty()) fmt::print("stationary {}\n", solution.stationarity);
  if (!solution.succeeded()) return 1;
  const ControlTrajectory& trajectory = solution.trajectory;
  fmt::print("objective  {:.10g}\n", trajectory.objective);
  if (problem->is_time_free) fmt::print("T          {:.10g} s\n", trajectory.T);
  print_impulses(*problem, trajectory);
  if (!options.csv.empty()) {
    write_text("controls", options.csv,
               controls_csv(trajectory.u, trajectory.T / static_cast<double>(trajectory.u.cols())));
    fmt::print("controls   {}\n", options.csv);
  }
  if (!options.plot.empty()) draw(*problem, solution, options.control, options.plot);
  if (!options.no_replay) fmt::print("\n{}", replay_table(*problem, trajectory).text());
  return 0;
}

}  // namespace

void add_control_command(CLI::App& app, int& exit_code) {
  static ControlArguments o;
  o = {};  // a test reads many command lines
  auto* command =
      app.add_subcommand("control", "solve an optimal control problem with contacts, replay it on the plant, draw it");
  o.control.add(*command);
  command->add_flag("--no-replay", o.no_replay, "do not replay the controls on the plant");
  command->add_option("--plot", o.plot, "write figures and an animation of the solution to FOLDER");
  command->add_option("--csv", o.csv,
                      "write the controls of the solution to FILE, a row per interval: `guess` of a control problem's "
                      "file takes it");
  command
      ->add_flag("--json", o.as_json,
                 "print the solution and its replay as JSON: a row of the experiment optimal_control")
      ->excludes("--plot")
      ->excludes("--csv");
  command->footer(
      "Examples:\n"
      "  ricochet control two_carts --simulate --sigma-0 0.01\n"
      "  ricochet control three_boxes --method shooting --explore 12 --seed 5\n"
      "  ricochet control push_box_goal -N 40 --method shooting --explore 12 --refine 2\n"
      "  ricochet control examples/control/catch_ball.json --method shooting\n"
      "  ricochet control discs --method shooting --noise 0.5 --from-relaxation 0.01\n"
      "  ricochet control two_carts --discretisation time_stepping --steps 6 --plot out/two_carts");
  command->callback([&exit_code] { exit_code = solve_control_problem(o); });
}

}  // namespace ricochet
