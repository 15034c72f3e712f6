#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <random>

#include "bench/commands.h"
#include "bench/problem_options.h"
#include "bench/replay.h"
#include "methods/complementarity/homotopy.h"
#include "methods/control/exploration.h"
#include "methods/control/fesd_transcription.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"
#include "reports/figures.h"
#include "reports/table.h"

namespace ricochet {
namespace {

struct Options {
  std::string problem;
  std::vector<std::string> changes;
  int intervals = 0, elements = 0;
  std::string tableau;
  std::string impulses = "position_velocity", cone = "exact", cross = "aggregated", equilibration = "objective";
  FesdEquations::Options equations;
  HomotopyOptions homotopy{.sigma_final = 1e-6,
                           .factor = 0.01,
                           .tolerance_per_sigma = 1,
                           .loosest_tolerance = 1e-3,
                           .sigma_crossover = 1e-4,
                           .warm_multipliers = false,
                           .adaptive_barrier = true,
                           .push = 1e-3,
                           .max_iterations = 500,
                           .time_limit = 120};
  bool superlinear = false;
  bool simulate = false;
  ExplorationOptions exploration{.rounds = 0};
  double noise = 0;
  bool no_replay = false;
  std::string plot;
};

/// The value of an option that takes one of a few names.
template <class Value>
Value choose(const std::string& option, const std::string& name, const std::map<std::string, Value>& values) {
  const auto found = values.find(name);
  if (found != values.end()) return found->second;
  std::string known;
  for (const auto& [key, value] : values) known += (known.empty() ? "" : ", ") + key;
  throw InputError(option, name, "one of " + known + " is required");
}

FesdEquations::Options equation_options(const Options& options, const OptimalControlProblem& problem) {
  using E = FesdEquations;
  E::Options result = options.equations;
  result.n_fe = problem.n_fe;
  result.impulses =
      choose<E::Impulses>("--impulses", options.impulses,
                          {{"position_velocity", E::Impulses::position_velocity}, {"slack", E::Impulses::slack}});
  result.cone =
      choose<E::Cone>("--cone", options.cone,
                      {{"exact", E::Cone::exact}, {"squared", E::Cone::squared}, {"polyhedral", E::Cone::polyhedral}});
  result.cross = choose<E::CrossComplementarity>("--cross", options.cross,
                                                 {{"sparse", E::CrossComplementarity::sparse},
                                                  {"per_stage", E::CrossComplementarity::per_stage},
                                                  {"aggregated", E::CrossComplementarity::aggregated}});
  result.equilibration = choose<E::Equilibration>("--equilibration", options.equilibration,
                                                  {{"objective", E::Equilibration::objective},
                                                   {"exact", E::Equilibration::exact},
                                                   {"tanh", E::Equilibration::tanh},
                                                   {"none", E::Equilibration::none}});
  return result;
}

/// Moves the guess of every position by up to `noise`: a plain guess may be a symmetric point that no descent leaves.
void disturb(Nlp& nlp, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-noise, noise);
  for (auto& variable : nlp.variables) {
    if (variable.lower < variable.upper && variable.name.find(", q[") != std::string::npos)
      variable.guess += uniform(random);
  }
}

void print_step(const HomotopyStep& step) {
  fmt::print("  {:8.1e}  {:10}  {:12.6g}  {:8.1e}  {:8.1e}  {:7.2f}  {:5.1f} %{}\n", step.sigma, step.iterations,
             step.objective, step.complementarity, step.violation, step.seconds,
             step.seconds > 0 ? 100 * step.derivative_seconds / step.seconds : 0.0,
             is_solved(step.status) ? "" : "  not solved");
  std::fflush(stdout);
}

Table replay_table(const OptimalControlProblem& problem, const ControlTrajectory& trajectory) {
  Table table;
  table.title = "Open-loop replay of the controls";
  table.note =
      "Mismatch: replay minus claim. Events: largest difference of impact times; other, when not the same contacts.";
  table.columns = {{"integrator", true}, {"status", true},  {"terminal"},   {"events [s]"},
                   {"true cost"},        {"minus claimed"}, {"penetration"}};
  const std::pair<const char*, IntervalSolver> solvers[] = {{"reference, CVODE with events", reference_solver(1e-11)},
                                                            {"FESD-J, pivoting, adaptive", pivoting_solver(1e-9)}};
  for (const auto& [name, solve] : solvers) {
    const Replay truth = replay(problem, trajectory, solve);
    if (truth.status != Status::success) {
      table.rows.push_back({name, truth.message, "-", "-", "-", "-", "-"});
      continue;
    }
    const ReplayMismatch difference = mismatch(problem, trajectory, truth);
    table.rows.push_back({name, "success", fmt::format("{:.2e}", difference.terminal),
                          std::isfinite(difference.events) ? fmt::format("{:.2e}", difference.events) : "other",
                          fmt::format("{:.8g}", truth.cost), fmt::format("{:+.2e}", difference.cost),
                          truth.is_sampled ? fmt::format("{:.1e}", truth.penetration) : "-"});
  }
  return table;
}

void print_impulses(const OptimalControlProblem& problem, const ControlTrajectory& trajectory) {
  const double least = smallest_impact(problem, trajectory);
  for (const auto& impulse : trajectory.impulses) {
    if (impulse.Lambda_n > least)
      fmt::print("impact     t = {:.9g} s  {}  Lambda_n = {:.6g} N s\n", impulse.t,
                 problem.plant->info().contacts[impulse.contact].name, impulse.Lambda_n);
  }
}

void draw(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, const std::string& folder) {
  Trajectory figure{problem.id, "FESD-J, optimal control", {}, {}, {}};
  for (const auto& point : trajectory.points) {
    figure.t.push_back(point.t);
    figure.q.emplace_back(point.q.begin(), point.q.end());
    figure.v.emplace_back(point.v.begin(), point.v.end());
  }
  fmt::print("figure     {}/{}\n", folder, FigureFolder(folder).trajectory(figure, problem.id).file);
}

/// Whose motion is the guess; none for the plain guess, a constant state.
std::optional<Matrix> guessed_controls(const OptimalControlProblem& problem, const Options& options) {
  if (options.exploration.rounds > 0) {
    const auto found = explore(problem, tableau_argument(problem.tableau), problem.n_fe, options.exploration);
    fmt::print("explored   {} rollouts in {:.2f} s, {} of them without a solution: cost {:.6g}, violation {:.2g}\n",
               found.rollouts, found.seconds, found.failed, found.rollout.cost, found.rollout.violation);
    return found.u;
  }
  if (options.simulate) return problem.plant->info().u.replicate(1, problem.n_intervals);
  return {};
}

int solve(const Options& options) {
  const auto problem = make_control_problem(options.problem, parameter_changes(options.changes));
  if (options.intervals > 0) problem->n_intervals = options.intervals;
  if (options.elements > 0) problem->n_fe = options.elements;
  if (!options.tableau.empty()) problem->tableau = options.tableau;
  if (!options.plot.empty() && !can_draw())
    throw InputError("--plot", options.plot, "gnuplot is needed for figures and was not found");
  for (const auto& [name, value] : {std::pair("--noise", options.noise), std::pair("--rho", options.equations.rho),
                                    std::pair("--eps-c", options.equations.eps_c)}) {
    if (!(value >= 0) || !std::isfinite(value)) throw InputError(name, value, "a finite number >= 0 is required");
  }
  HomotopyOptions homotopy = options.homotopy;
  if (options.superlinear) homotopy.update = SigmaUpdate::superlinear;
  const Homotopy solver(homotopy);
  FesdTranscription transcription(*problem, tableau_argument(problem->tableau), equation_options(options, *problem));
  if (const auto u = guessed_controls(*problem, options)) {
    const Status status = transcription.set_guess(*u);
    if (status != Status::success) fmt::print("guess      the simulation ended early: {}\n", to_string(status));
  }
  disturb(transcription.mpcc().nlp, options.noise, options.exploration.seed);

  const Mpcc& mpcc = transcription.mpcc();
  fmt::print("problem    {}: {}\n", problem->id, problem->title);
  fmt::print("program    FESD-J {}, {} intervals of {} elements: {} variables, {} rows, {} complementarity pairs\n",
             problem->tableau, problem->n_intervals, problem->n_fe, mpcc.nlp.n_variables(), mpcc.nlp.n_rows(),
             mpcc.pairs.size());
  fmt::print("homotopy   {}\n  {:>8}  {:>10}  {:>12}  {:>8}  {:>8}  {:>7}  derivatives\n", homotopy.relaxation, "sigma",
             "iterations", "objective", "G _|_ H", "violated", "s");
  const MpccSolution solution = solver.solve(mpcc, print_step);
  fmt::print("status     {}{}\n", to_string(solution.status), solution.message.empty() ? "" : ": " + solution.message);
  fmt::print("solved in  {:.2f} s, {} iterations, {:.0f} % in derivatives\n", solution.seconds, solution.iterations,
             solution.seconds > 0 ? 100 * solution.derivative_seconds / solution.seconds : 0.0);
  fmt::print("complement max min(G, H) = {:.1e}, worst violation {:.1e}, {}\n", solution.complementarity,
             solution.violation.value, solution.violation.name);
  if (!solution.succeeded()) return 1;
  fmt::print("stationary {}{}, {} biactive pairs\n", to_string(solution.stationarity),
             solution.is_b_stationary ? ", B" : "", solution.n_biactive);
  const ControlTrajectory trajectory = transcription.trajectory(solution.x);
  fmt::print("objective  {:.10g}\n", trajectory.objective);
  if (problem->is_time_free) fmt::print("T          {:.10g} s\n", trajectory.T);
  print_impulses(*problem, trajectory);
  if (!options.plot.empty()) draw(*problem, trajectory, options.plot);
  if (!options.no_replay) fmt::print("\n{}", replay_table(*problem, trajectory).text());
  return 0;
}

}  // namespace

void add_control_command(CLI::App& app, int& exit_code) {
  static Options o;
  auto* command = app.add_subcommand("control", "optimal control through contact: solve, replay, draw");
  command->add_option("problem", o.problem, "optimal control problem, see `ricochet list control`")->required();
  command->add_option("--set", o.changes, "NAME=VALUE, a parameter of the problem");
  command->add_option("--intervals,-N", o.intervals, "control intervals")->check(CLI::PositiveNumber);
  command->add_option("--elements", o.elements, "finite elements per interval")->check(CLI::PositiveNumber);
  command->add_option("--tableau", o.tableau, "FAMILY:STAGES, or @FILE");
  command->add_option("--cross", o.cross, "cross complementarity: sparse, per_stage, aggregated")
      ->capture_default_str();
  command->add_option("--impulses", o.impulses, "position_velocity or slack")->capture_default_str();
  command->add_option("--cone", o.cone, "friction cone: exact, squared, polyhedral")->capture_default_str();
  command->add_option("--equilibration", o.equilibration, "of the steps: objective, exact, tanh, none")
      ->capture_default_str();
  command->add_option("--rho", o.equations.rho, "weight of --equilibration objective")->capture_default_str();
  command->add_flag("!--capture", o.equations.no_capture, "as published: a closed element may absorb a bounce");
  command->add_flag("--project", o.equations.projects,
                    "end velocities of curved contacts without friction are projected");
  command->add_option("--eps-c", o.equations.eps_c, "gaps stay open over this part of a step; 0 for none")
      ->capture_default_str();
  command->add_option("--relaxation", o.homotopy.relaxation, "of the complementarity pairs")->capture_default_str();
  command->add_option("--sigma-0", o.homotopy.sigma_0, "first relaxation parameter")->capture_default_str();
  command->add_option("--sigma-final", o.homotopy.sigma_final, "last one, before the crossover")->capture_default_str();
  command->add_option("--factor", o.homotopy.factor, "from one sigma to the next")->capture_default_str();
  command->add_flag("--superlinear", o.superlinear, "sigma to the power 1.5 when that is less than factor * sigma");
  command->add_option("--max-iterations", o.homotopy.max_iterations, "of one homotopy step")->capture_default_str();
  command->add_option("--time-limit", o.homotopy.time_limit, "wall time [s]; 0 for none")->capture_default_str();
  command->add_flag("--simulate", o.simulate,
                    "guess: the motion under the guessed control, instead of a constant state");
  command
      ->add_option("--explore", o.exploration.rounds,
                   "guess: the best motion of a random search over the controls with so many rounds")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--noise", o.noise, "random change of the guessed positions, up to this")->capture_default_str();
  command->add_option("--seed", o.exploration.seed, "of --explore and --noise")->capture_default_str();
  command->add_flag("--no-replay", o.no_replay, "do not run the controls on the plant");
  command->add_option("--plot", o.plot, "FOLDER for a figure of the motion");
  command->callback([&exit_code] { exit_code = solve(o); });
}

}  // namespace ricochet
