#include "bench/control/control_guess.h"

#include <fmt/format.h>

#include <random>

#include "methods/control/shooting/tracking.h"
#include "methods/runge_kutta/tableau_argument.h"

namespace ricochet {
namespace {

/// Moves the guess of every position by up to `noise`: a plain guess may be a symmetric point that no descent leaves.
void disturb(Nlp& nlp, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-noise, noise);
  for (auto& variable : nlp.variables) {
    if (variable.lower < variable.upper && variable.name.find(", q[") != std::string::npos)
      variable.guess += uniform(random);
  }
}

/// The controls that time stepping finds from its own guess.
Matrix time_stepping_controls(ControlOptions options, const OptimalControlProblem& problem,
                              std::vector<std::string>& notes) {
  options.discretisation = "time_stepping";
  options.steps = options.from_time_stepping;
  options.from_time_stepping = 0;
  options.method = "homotopy";
  options.simulate = true;
  const auto transcription = guessed_transcription(options, problem).transcription;
  const MpccSolution solution = Homotopy(options.homotopy_options()).solve(transcription->mpcc());
  notes.push_back(fmt::format("guess      {}: {} in {:.2f} s, objective {:.6g}", options.describe(problem),
                              to_string(solution.status), solution.seconds, solution.objective));
  return transcription->trajectory(solution.x).u;
}

/// A random search over the controls.
ExplorationResult explored_controls(const ExplorationOptions& options, const OptimalControlProblem& problem,
                                    std::vector<std::string>& notes) {
  const auto found = explore(problem, tableau_argument(problem.tableau), problem.n_fe, options);
  notes.push_back(
      fmt::format("explored   {} rollouts in {:.2f} s, {} of them without a solution: cost {:.6g}, violation {:.2g}",
                  found.rollouts, found.seconds, found.failed, found.rollout.cost, found.rollout.violation));
  return found;
}

/// Relaxes the discretised problem, from the guess of the homotopy, and lets the plant follow that motion.
void follow_relaxation(const ControlOptions& options, const OptimalControlProblem& problem, GuessedControls& guess) {
  HomotopyOptions homotopy = options.relaxation_options();
  auto [transcription, notes] = guessed_transcription(options, problem);
  guess.notes = std::move(notes);
  const MpccSolution relaxed = Homotopy(homotopy).solve(transcription->mpcc());
  guess.notes.push_back(fmt::format("relaxed    {} in {:.2f} s, {} iterations: objective {:.6g}, violation {:.1e}",
                                    relaxed.succeeded() ? "success" : relaxed.message, relaxed.seconds,
                                    relaxed.iterations, relaxed.objective, relaxed.violation.value));
  const ControlTrajectory trajectory = transcription->trajectory(relaxed.x);
  const double H = trajectory.T / problem.n_intervals;
  PlantRunner runner(problem, tableau_argument(problem.tableau));
  const Tracking tracked = track(runner, trajectory.u, H, transcription->states(relaxed.x), {});
  PlantMotion motion;
  runner.run(problem.plant->info().q0, problem.plant->info().v0, tracked.u, H, motion);
  guess.notes.push_back(fmt::format("tracked    {} rollouts, distance {:.2g}: cost {:.6g}, violation {:.1e}{}{}",
                                    runner.rollouts(), tracked.distance, motion.cost, runner.worst(motion).value,
                                    tracked.message.empty() ? "" : "; ", tracked.message));
  guess.u.push_back(tracked.u);
  guess.T = trajectory.T;
}

}  // namespace

GuessedTranscription guessed_transcription(const ControlOptions& options, const OptimalControlProblem& problem) {
  GuessedTranscription made{options.make_transcription(problem), {}};
  Transcription& transcription = *made.transcription;
  if (options.simulate || options.from_time_stepping > 0 || options.exploration.rounds > 0) {
    const Status status =
        options.exploration.rounds > 0
            ? transcription.guess_from_simulation(explored_controls(options.exploration, problem, made.notes).u)
        : options.from_time_stepping > 0
            ? transcription.guess_from_simulation(time_stepping_controls(options, problem, made.notes))
            : transcription.guess_from_simulation();
    if (status != Status::success)
      made.notes.push_back(fmt::format("guess      the simulation ended early: {}", to_string(status)));
  }
  disturb(transcription.mpcc().nlp, options.noise, options.exploration.seed);
  return made;
}

GuessedControls guessed_controls(const ControlOptions& options) {
  const auto problem = options.make_coarse_problem();
  GuessedControls guess;
  guess.T = problem->plant->info().end_time;
  if (options.from_relaxation > 0)
    follow_relaxation(options, *problem, guess);
  else if (options.exploration.rounds > 0)
    guess.u = explored_controls(options.exploration, *problem, guess.notes).starts;
  if (guess.u.empty()) guess.u.push_back(problem->guess(problem->n_intervals));
  return guess;
}

PreparedMethod prepared_method(const ControlOptions& options, const OptimalControlProblem& problem,
                               const ControlProgress& progress) {
  PreparedMethod made;
  if (options.is_shooting()) {
    const ButcherTableau tableau = tableau_argument(problem.tableau);
    Shooting(problem, tableau, options.shooting);  // rejects them before a search of seconds
    GuessedControls guess = guessed_controls(options);
    made.notes = std::move(guess.notes);
    made.solver = std::make_unique<ShootingControlSolver>(
        problem, tableau, options.shooting,
        ShootingControlSolver::Start{std::move(guess.u), guess.T, options.refine, options.update_limit},
        progress.shooting);
    return made;
  }
  const HomotopyOptions homotopy = options.homotopy_options();
  Homotopy{homotopy};  // likewise
  GuessedTranscription guess = guessed_transcription(options, problem);
  made.transcription = std::move(guess.transcription);
  made.notes = std::move(guess.notes);
  made.solver = std::make_unique<HomotopyControlSolver>(*made.transcription, homotopy, progress.homotopy);
  return made;
}

}  // namespace ricochet
