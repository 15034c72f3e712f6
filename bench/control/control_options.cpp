#include "bench/control/control_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>

#include "bench/commands/number_checks.h"
#include "bench/commands/problem_options.h"
#include "methods/control/fesd_transcription.h"
#include "methods/control/time_stepping_transcription.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// Part of the time limit that --from-relaxation may take.
constexpr double kRelaxationTime = 0.5;

/// The value of an option that takes one of a few names.
template <class Value>
Value choose(const std::string& option, const std::string& name, const Names<Value>& names) {
  if (const Value* value = find(names, name)) return *value;
  throw InputError(option, name, fmt::format("one of {} is required", fmt::join(list(names), ", ")));
}

FrictionCone cone_of(const ControlOptions& options) {
  return choose("--cone", options.cone, friction_cone_names());
}

FesdEquations::Options equation_options(const ControlOptions& options, const OptimalControlProblem& problem) {
  using E = FesdEquations;
  E::Options result = options.equations;
  result.n_fe = problem.n_fe;
  result.cone = cone_of(options);
  result.impulses = choose("--impulses", options.impulses, E::impulse_names());
  result.cross = choose("--cross", options.cross, E::cross_names());
  result.equilibration = choose("--equilibration", options.equilibration, E::equilibration_names());
  return result;
}

}  // namespace

void ControlOptions::add(CLI::App& command) {
  command
      .add_option(
          "problem", problem,
          "name of an optimal control problem, see `ricochet list control`, or a scene file with a block control")
      ->required();
  command
      .add_option("--method", method,
                  "homotopy: relaxations of a discretised problem; shooting: optimisation over runs of the plant")
      ->check(CLI::IsMember({"homotopy", "shooting"}))
      ->capture_default_str();
  command.add_option("--set", changes, "NAME=VALUE: set a parameter of the problem; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--intervals,-N", intervals, "number of control intervals")->check(positive_number());
  command.add_option("--discretisation", discretisation, "discretisation: fesd, time_freezing or time_stepping")
      ->check(CLI::IsMember({"fesd", "time_freezing", "time_stepping"}))
      ->capture_default_str()
      ->group(kOfHomotopy);
  command.add_option("--steps", steps, "steps per interval (--discretisation time_stepping)")
      ->check(positive_number())
      ->capture_default_str()
      ->group(kOfHomotopy);
  command.add_option("--a-n", freezing.a_n, "gap acceleration of a push [m/s^2] (--discretisation time_freezing)")
      ->capture_default_str()
      ->group(kOfHomotopy);
  command
      .add_option("--bounce", freezing.bounce,
                  "pseudo time of a bounce in control intervals (--discretisation time_freezing)")
      ->capture_default_str()
      ->group(kOfHomotopy);
  command.add_option("--elements", elements, "number of finite elements per interval")->check(positive_number());
  command.add_option("--tableau", tableau, "Runge-Kutta tableau, FAMILY:STAGES or @FILE");
  command.add_option("--cross", cross, "form of the cross complementarity: sparse, per_stage or aggregated")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--impulses", impulses, "form of the impulses: position_velocity or slack")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--cone", cone, "friction cone: exact, squared or polyhedral")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--equilibration", equilibration, "step equilibration: objective, exact, tanh or none")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--rho", equations.rho, "weight of --equilibration objective")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command
      .add_flag("!--capture", equations.no_capture,
                "let a closed element absorb a bounce, as the published equations do")
      ->group(kOfRelaxation);
  command.add_flag("--project", equations.projects, "project end velocities of curved contacts without friction")
      ->group(kOfRelaxation);
  command.add_option("--eps-c", equations.eps_c, "fraction of a step over which open gaps must stay open; 0 for none")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--relaxation", homotopy.relaxation, "relaxation of the complementarity pairs")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--sigma-0", homotopy.sigma_0, "first relaxation parameter")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_option("--sigma-final", homotopy.sigma_final, "last relaxation parameter before the crossover")
      ->capture_default_str()
      ->group(kOfHomotopy);
  command.add_option("--factor", homotopy.factor, "factor from one relaxation parameter to the next")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command.add_flag("--superlinear", superlinear, "use sigma to the power 1.5 if it is less than factor * sigma")
      ->group(kOfRelaxation);
  command.add_option("--linear-solver", linear_solver, "solver of Ipopt's linear systems: mumps or ldl")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command
      .add_option("--max-iterations", homotopy.max_iterations,
                  "limit of iterations: of a homotopy step, or of shooting (default there: 300)")
      ->capture_default_str();
  command
      .add_option("--max-branches", homotopy.max_branches,
                  "number of branches that the crossover tries after the first")
      ->check(non_negative_number())
      ->capture_default_str()
      ->group(kOfHomotopy);
  command.add_option("--time-limit", homotopy.time_limit, "limit of the wall time [s]; 0 for none")
      ->capture_default_str()
      ->check(non_negative_number());
  command
      .add_flag("--simulate", simulate,
                "initial guess: the motion under the guessed control (default: a constant state)")
      ->group(kOfRelaxation);
  command
      .add_option(
          "--from-time-stepping", from_time_stepping,
          "initial guess: the motion under controls found by time stepping with this number of steps per interval")
      ->check(positive_number())
      ->group(kOfRelaxation);
  command
      .add_option("--explore", exploration.rounds,
                  "initial guess: the best motion of a random search over the controls with this number of rounds")
      ->check(non_negative_number());
  command
      .add_option("--knots", exploration.knots,
                  "number of knots between which --explore interpolates controls, from 2 to the number of intervals "
                  "(default: one per interval, but 10 at most)")
      ->check(CLI::Number);
  command.add_option("--noise", noise, "largest random change of the guessed positions")
      ->capture_default_str()
      ->group(kOfRelaxation);
  command
      .add_option("--starts", exploration.starts,
                  "number of the best controls of --explore that are tried for a few iterations; the best goes on")
      ->group(kOfShooting);
  command
      .add_option(
          "--refine", refine,
          "solve on 2^K times fewer intervals first, then K times split each in two; --explore is on the fewest")
      ->type_name("K")
      ->group(kOfShooting);
  command
      .add_option(
          "--from-relaxation", from_relaxation,
          "initial guess: controls with which the plant follows the motion of a relaxation with one element per "
          "interval, from --sigma-0 down to this relaxation parameter")
      ->group(kOfShooting);
  command.add_option("--seed", exploration.seed, "seed of --explore and --noise")
      ->check(non_negative_number())
      ->capture_default_str();
  command.parse_complete_callback([this, &command] {
    const bool relaxes = !is_shooting() || command.get_option("--from-relaxation")->count() > 0;
    const auto is_of_other = [&](const std::string& group) {
      return group == (is_shooting() ? kOfHomotopy : kOfShooting) || (group == kOfRelaxation && !relaxes);
    };
    const bool is_other_discretisation = is_shooting() && discretisation != "fesd";
    if (is_other_discretisation)
      throw InputError("--discretisation", discretisation, "fesd is required, the only one of --method shooting");
    for (const CLI::Option* option : command.get_options()) {
      if (option->count() == 0 || !is_of_other(option->get_group()) || option->get_name() == "--discretisation")
        continue;
      throw InputError(option->get_name(), fmt::format("{}", fmt::join(option->results(), " ")),
                       fmt::format("no value is allowed with --method {}, which has no such option", method));
    }
    for (const char* name : {"--knots", "--starts"}) {
      if (command.get_option(name)->count() > 0 && exploration.rounds == 0)
        throw InputError(name, fmt::format("{}", fmt::join(command.get_option(name)->results(), " ")),
                         "--explore is required, the search that it belongs to");
    }
    if (command.get_option("--knots")->count() > 0 && exploration.knots == 0)  // of ExplorationOptions: the default
      throw InputError("--knots", 0, "a number from 2 to the number of control intervals is required");
    if (command.get_option("--from-relaxation")->count() > 0 &&
        !(from_relaxation > 0 && from_relaxation <= homotopy.sigma_0))
      throw InputError("--from-relaxation", from_relaxation,
                       fmt::format("a number > 0 and <= --sigma-0 = {:g} is required", homotopy.sigma_0));
    if (from_relaxation > 0 && command.get_option("--starts")->count() > 0)
      throw InputError("--starts", exploration.starts,
                       "no value is allowed with --from-relaxation, which is one start");
    if (is_shooting() && command.get_option("--max-iterations")->count() > 0) {
      shooting.max_iterations = homotopy.max_iterations;
      homotopy.max_iterations = ControlOptions().homotopy.max_iterations;
    }
    shooting.time_limit = homotopy.time_limit;
  });
}

ControlOptions ControlOptions::parse(const std::string& arguments) {
  ControlOptions options;
  CLI::App app;
  options.add(app);
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    throw InputError("arguments of ricochet control", arguments, error.what());
  }
  return options;
}

std::unique_ptr<OptimalControlProblem> ControlOptions::make_problem() const {
  auto made = make_control_problem(problem, parameter_changes(changes));
  if (intervals > 0) made->n_intervals = intervals;
  if (elements > 0) made->n_fe = elements;
  if (!tableau.empty()) made->tableau = tableau;
  int most = 0;
  while (made->n_intervals % (2 << most) == 0) ++most;
  if (refine < 0 || refine > most)
    throw InputError("--refine", refine,
                     fmt::format("a number from 0 to {} is required: {} intervals can be halved so many times", most,
                                 made->n_intervals));
  check(exploration, made->n_intervals >> refine);
  return made;
}

std::unique_ptr<OptimalControlProblem> ControlOptions::make_coarse_problem() const {
  auto made = make_problem();
  made->n_intervals >>= refine;
  return made;
}

std::unique_ptr<Transcription> ControlOptions::make_transcription(const OptimalControlProblem& made) const {
  for (const auto& [name, value] :
       {std::pair("--noise", noise), std::pair("--rho", equations.rho), std::pair("--eps-c", equations.eps_c)}) {
    if (!(value >= 0) || !std::isfinite(value)) throw InputError(name, value, "a finite number >= 0 is required");
  }
  if (is_fesd())
    return std::make_unique<FesdTranscription>(made, tableau_argument(made.tableau), equation_options(*this, made));
  if (discretisation == "time_freezing") {
    for (const auto& [name, value] : {std::pair("--a-n", freezing.a_n), std::pair("--bounce", freezing.bounce)}) {
      if (!(value > 0) || !std::isfinite(value)) throw InputError(name, value, "a finite number > 0 is required");
    }
    auto options = freezing;
    options.rho = equations.rho;
    options.no_capture = equations.no_capture;
    return std::make_unique<TimeFreezingTranscription>(made, tableau_argument(made.tableau), options);
  }
  return std::make_unique<TimeSteppingTranscription>(
      made, TimeSteppingTranscription::Options{.steps = steps, .equations = {.cone = cone_of(*this)}});
}

HomotopyOptions ControlOptions::homotopy_options() const {
  if (is_shooting()) throw InputError("--method", method, "homotopy is required here");
  return relaxation_options();
}

HomotopyOptions ControlOptions::relaxation_options() const {
  HomotopyOptions result = homotopy;
  result.warm_time_limit = update_limit;
  result.linear_solver = choose("--linear-solver", linear_solver, linear_solver_names());
  if (superlinear) result.update = SigmaUpdate::superlinear;
  if (!is_shooting()) return result;
  result.sigma_final = from_relaxation;
  result.cross_over = false;
  result.time_limit = kRelaxationTime * homotopy.time_limit;
  return result;
}

std::string ControlOptions::describe(const OptimalControlProblem& made) const {
  const auto elements_of = [&](const char* name) {
    return fmt::format("{} {}, {} intervals of {} elements", name, made.tableau, made.n_intervals, made.n_fe);
  };
  if (is_shooting())
    return fmt::format("FESD-J {}, {} intervals of {} elements or more", made.tableau, made.n_intervals, made.n_fe);
  if (discretisation == "time_freezing") return elements_of("time freezing");
  return is_fesd() ? elements_of("FESD-J")
                   : fmt::format("time stepping, {} intervals of {} steps", made.n_intervals, steps);
}

}  // namespace ricochet
