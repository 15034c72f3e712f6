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

/// A discretised problem, and the end of its relaxations.
struct RelaxedProblem {
  std::unique_ptr<OptimalControlProblem> problem;  // that the transcription refers to
  std::unique_ptr<Transcription> transcription;
  MpccSolution solution;
};

/// Relaxes the problem, discretised with n_fe elements per interval, from the guess of the homotopy.
RelaxedProblem relax(const ControlOptions& options, int n_fe, const HomotopyOptions& homotopy,
                     std::vector<std::string>& notes) {
  RelaxedProblem relaxed{options.make_coarse_problem(), nullptr, {}};
  relaxed.problem->n_fe = n_fe;
  GuessedTranscription guess = guessed_transcription(options, *relaxed.problem);
  relaxed.transcription = std::move(guess.transcription);
  notes.insert(notes.end(), guess.notes.begin(), guess.notes.end());
  relaxed.solution = Homotopy(homotopy).solve(relaxed.transcription->mpcc());
  const MpccSolution& solution = relaxed.solution;
  notes.push_back(
      fmt::format("relaxed    elements: {}; {} in {:.2f} s, {} iterations: objective {:.6g}, violation {:.1e}", n_fe,
                  solution.succeeded() ? "success" : solution.message, solution.seconds, solution.iterations,
                  solution.objective, solution.violation.value));
  return relaxed;
}

/// Lets the plant follow the motion of a relaxation. To find the contacts, one element per interval is enough in most
/// cases; where that has no solution, as where a contact bounces within an interval, the elements of the problem are taken.
void follow_relaxation(const ControlOptions& options, const OptimalControlProblem& problem, GuessedControls& guess) {
  HomotopyOptions homotopy = options.relaxation_options();
  RelaxedProblem coarse = relax(options, 1, homotopy, guess.notes);
  const double left = homotopy.time_limit - coarse.solution.seconds;
  const bool has_time = homotopy.time_limit == 0 || (left > 0 && coarse.solution.status != Status::time_limit);
  if (!coarse.solution.succeeded() && problem.n_fe > 1 && has_time) {
    if (homotopy.time_limit > 0) homotopy.time_limit = left;
    coarse.transcription.reset();  // before its problem
    coarse = relax(options, problem.n_fe, homotopy, guess.notes);
  }
  const auto& [made, transcription, relaxed] = coarse;
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
