#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bench/control/control_claim.h"
#include "bench/control/control_guess.h"
#include "bench/control/control_options.h"
#include "bench/control/replay.h"
#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "bench/studies/control/control_views.h"
#include "bench/studies/control/leave_times_out.h"
#include "methods/complementarity/mpcc/homotopy.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Tolerance of the event-located reference.
constexpr double kReferenceReplayTolerance = 1e-11;
constexpr double kPivotingTolerance = 1e-9;

constexpr const char* kCommand = "ricochet control ";

void describe_replay(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, ControlRun& run) {
  Replay truth = replay(problem, trajectory, reference_solver(kReferenceReplayTolerance));
  run.replayed_by = "reference";
  run.replay_message = truth.message;
  if (truth.status != Status::success) {
    truth = replay(problem, trajectory, pivoting_solver(kPivotingTolerance));
    run.replayed_by = "pivoting";
  }
  run.replay_status = to_string(truth.status);
  const int n = problem.plant->info().n_mechanical();
  for (const auto& point : truth.points) {
    run.replayed.t.push_back(point.t);
    run.replayed.q.emplace_back(point.q.begin(), point.q.begin() + n);
    run.replayed.v.emplace_back(point.v.begin(), point.v.begin() + n);
  }
  if (truth.status != Status::success) return;
  const ReplayMismatch difference = mismatch(problem, trajectory, truth);
  run.true_cost = truth.cost;
  run.terminal = difference.terminal;
  run.events = std::isfinite(difference.events) ? difference.events : std::numeric_limits<double>::quiet_NaN();
}

ControlRun solve_and_replay(const ControlOptions& options, const std::string& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const auto problem = options.make_problem();
  ControlRun run;
  run.problem = problem->id;
  run.title = problem->title;
  run.discretisation = options.describe(*problem);
  run.command = kCommand + arguments;
  const auto transcription = guessed_transcription(options, *problem).transcription;
  const MpccSolution solution = Homotopy(options.homotopy_options()).solve(transcription->mpcc());
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.variables = transcription->mpcc().nlp.n_variables();
  run.pairs = static_cast<int>(transcription->mpcc().pairs.size());
  run.status = to_string(solution.status);
  run.message = solution.message;
  run.iterations = solution.iterations;
  if (!solution.succeeded()) return run;
  const ControlTrajectory trajectory = transcription->trajectory(solution.x);
  describe_claim(*problem, trajectory, run);
  describe_replay(*problem, trajectory, run);
  return run;
}

int variables_of(const ControlOptions& options) {
  const auto problem = options.make_problem();
  return options.make_transcription(*problem)->mpcc().nlp.n_variables();
}

/// Steps per interval with which time stepping has so many variables, as nearly as possible.
int steps_of_equal_size(int variables, ControlOptions options) {
  const auto problem = options.make_problem();
  const auto size = [&](int steps) {
    options.steps = steps;
    return options.make_transcription(*problem)->mpcc().nlp.n_variables();
  };
  const int one = size(1), two = size(2);
  return std::max(1, static_cast<int>(std::lround(1 + static_cast<double>(variables - one) / (two - one))));
}

/// Problems with FESD-J, and with time stepping with the same number of variables; the controls are replayed. "runs":
/// [{"problem", "fesd", "time_stepping"}], "fesd" and "time_stepping" with the arguments of `ricochet control`. Each of
/// the two runs is a piece.
void run_control_experiment(const json& experiment, ResultsFile& file) {
  const bool with_times = experiment.value("times", true);
  const json& runs = experiment.at("runs");
  const auto run_of = [&](std::size_t k) {
    const json& entry = runs[k / 2];
    const std::string problem = entry.at("problem");
    const std::string fesd = fmt::format("{} {}", problem, entry.at("fesd").get<std::string>());
    if (k % 2 == 0) return solve_and_replay(ControlOptions::parse(fesd), fesd);
    const std::string other =
        fmt::format("{} --discretisation time_stepping {}", problem, entry.at("time_stepping").get<std::string>());
    ControlOptions options = ControlOptions::parse(other);
    options.steps = steps_of_equal_size(variables_of(ControlOptions::parse(fesd)), options);
    return solve_and_replay(options, fmt::format("{} --steps {}", other, options.steps));
  };
  const auto solve = [&](std::size_t k) {
    ControlRun run = run_of(k);
    if (!with_times) leave_times_out(run);
    return run;
  };
  Progress progress(experiment.at("id").get<std::string>());
  const std::size_t n = 2 * runs.size();
  file.each<ControlRun>(n, solve, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(n), runs[k / 2].at("problem"));
  });
}

/// The problem of a run, by its command.
std::shared_ptr<const OptimalControlProblem> problem_of(const ControlRun& run) {
  return ControlOptions::parse(run.command.substr(std::string(kCommand).size())).make_problem();
}

/// Frames, animation and curves of the runs of one problem.
void show_problem(const std::vector<ControlRun>& runs, const std::string& name, Section& section) {
  section.heading(fmt::format("{}: {}", runs.front().problem, runs.front().title));
  const auto solved = std::ranges::find_if(runs, &ControlRun::succeeded);
  const auto problem = solved == runs.end() ? nullptr : problem_of(*solved);
  if (problem && problem->plant->info().geometry) {
    section.drawings([=, run = *solved](const FigureFolder& folder) {
      return std::vector{draw_frames(folder, *problem, run, name + "_frames")};
    });
    section.drawings([=, run = *solved](const FigureFolder& folder) {
      return std::vector{draw_scene(folder, *problem, run, name + "_scene")};
    });
  }
  section.chart(control_chart(runs, name));
}

void show_control_experiment(const Results& results, Section& section) {
  const auto runs = results.all<ControlRun>();
  section.result("runs", control_table(runs));
  section.failures("failures", control_failures(runs));
  for (std::size_t first = 0, last = 0; first < runs.size(); first = last) {
    while (last < runs.size() && runs[last].problem == runs[first].problem) ++last;
    show_problem({runs.begin() + static_cast<std::ptrdiff_t>(first), runs.begin() + static_cast<std::ptrdiff_t>(last)},
                 results.experiment() + "_" + runs[first].problem, section);
  }
}

/// Time stepping stands beside FESD-J for comparison: it may fail, and the table says so.
int control_experiment_unexpected_failures(const Results& results) {
  const auto runs = results.all<ControlRun>();
  return static_cast<int>(std::ranges::count_if(
      runs, [](const ControlRun& run) { return !run.succeeded() && run.discretisation.starts_with("FESD-J"); }));
}

constexpr const char* kControlExperimentFields = R"~({
  "required": ["runs"],
  "properties": {
    "runs": {"type": "array", "description": "Problems, each with FESD-J and with time stepping.", "items": {
      "type": "object", "additionalProperties": false, "required": ["problem", "fesd", "time_stepping"], "properties": {
        "problem": {"type": "string", "description": "Of `ricochet control`.", "examples": ["two_carts"]},
        "fesd": {"type": "string", "description": "Arguments of `ricochet control` with FESD-J.", "examples": ["--intervals 10"]},
        "time_stepping": {"type": "string", "description": "Those with time stepping.", "examples": ["--sigma-0 1"]}}}}
  }
})~";

const bool control_experiment_is_registered =
    register_study({.kind = "optimal_control",
                    .summary = "optimal control with FESD-J and with time stepping: what they claim and what is true",
                    .fields = kControlExperimentFields,
                    .rows = {ControlRun::kKind},
                    .times = Times::in_rows,
                    .run = run_control_experiment,
                    .show = show_control_experiment,
                    .unexpected_failures = control_experiment_unexpected_failures});

}  // namespace
}  // namespace ricochet
