#include "bench/studies/control_experiment.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "bench/control_claim.h"
#include "bench/control_options.h"
#include "bench/progress.h"
#include "bench/replay.h"
#include "bench/studies/control_gradient.h"
#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/named_values.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Of the event-located reference.
constexpr double kReferenceReplayTolerance = 1e-11;
constexpr double kPivotingTolerance = 1e-9;
constexpr double kGradientTolerance = 1e-12;
// Changes of a control for differences: of the reference, whose error is about its tolerance; and of a discrete scheme,
// which is smooth up to the next change of its active sets.
constexpr double kReferenceChange = 1e-3;
constexpr double kSchemeChange = 1e-6;

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

ControlRun solve(const ControlOptions& options, const std::string& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const auto problem = options.make_problem();
  ControlRun run;
  run.problem = problem->id;
  run.title = problem->title;
  run.discretisation = options.describe(*problem);
  run.command = "ricochet control " + arguments;
  const auto transcription = options.make_transcription(*problem);
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

/// Steps per interval with which time stepping has as many variables as the FESD-J run, as nearly as possible.
int steps_of_equal_size(const ControlRun& fesd, ControlOptions options) {
  options.from_time_stepping = 0;
  options.simulate = false;
  options.exploration.rounds = 0;
  const auto problem = options.make_problem();
  const auto size = [&](int steps) {
    options.steps = steps;
    return options.make_transcription(*problem)->mpcc().nlp.n_variables();
  };
  const int one = size(1), two = size(2);
  return std::max(1, static_cast<int>(std::lround(1 + static_cast<double>(fesd.variables - one) / (two - one))));
}

/// Relative to the reference's largest derivative of each component. @param n_columns  the last of them
double largest_error(const Matrix& gradient, const Matrix& reference, Eigen::Index n_columns) {
  double worst = 0;
  for (Eigen::Index row = 0; n_columns > 0 && row < gradient.rows(); ++row) {
    const double error = (gradient - reference).row(row).tail(n_columns).cwiseAbs().maxCoeff();
    worst = std::max(worst, error / reference.row(row).cwiseAbs().maxCoeff());
  }
  return worst;
}

}  // namespace

void compare_transcriptions(const json& document, ResultsFile& file) {
  Progress progress(document.at("id").get<std::string>());
  const json& runs = document.at("runs");
  double done = 0;
  for (const auto& entry : runs) {
    const std::string problem = entry.at("problem");
    const std::string fesd = fmt::format("{} {}", problem, entry.at("fesd").get<std::string>());
    const ControlRun run = solve(ControlOptions::parse(fesd), fesd);
    file.append(to_json(run));
    progress.update((done += 0.5) / static_cast<double>(runs.size()), problem);

    std::string other =
        fmt::format("{} --discretisation time_stepping {}", problem, entry.at("time_stepping").get<std::string>());
    ControlOptions options = ControlOptions::parse(other);
    options.steps = steps_of_equal_size(run, options);
    other += fmt::format(" --steps {}", options.steps);
    file.append(to_json(solve(options, other)));
    progress.update((done += 0.5) / static_cast<double>(runs.size()), problem);
  }
}

void compare_gradients(const json& document, ResultsFile& file) {
  const auto problem = make_control_problem(document.at("problem"));
  const auto control = document.at("control").get<std::vector<std::vector<double>>>();
  const ProblemInfo& info = problem->plant->info();
  ControlTrajectory trajectory;
  trajectory.T = info.end_time;
  trajectory.u.resize(info.n_u, static_cast<Eigen::Index>(control.size()));
  for (std::size_t k = 0; k < control.size(); ++k) {
    if (static_cast<int>(control[k].size()) != info.n_u)
      throw InputError("control", json(control[k]).dump(), fmt::format("{} numbers are required", info.n_u));
    for (int c = 0; c < info.n_u; ++c) trajectory.u(c, static_cast<Eigen::Index>(k)) = control[k][c];
  }

  const Matrix reference =
      gradient_by_differences(*problem, trajectory, reference_solver(kGradientTolerance), kReferenceChange);
  const Replay truth = replay(*problem, trajectory, reference_solver(kGradientTolerance));
  double last_impact = 0;
  for (const auto& event : truth.events) {
    if (event.kind == EventKind::impact) last_impact = event.t;
  }
  const auto n_until =
      static_cast<Eigen::Index>(std::ceil(last_impact * static_cast<double>(control.size()) / trajectory.T));
  const Eigen::Index n_behind = info.n_u * (static_cast<Eigen::Index>(control.size()) - n_until);

  ControlGradient line;
  line.problem = problem->id;
  for (const char* name : {"q", "v"}) {
    for (int k = 0; k < info.n_mechanical(); ++k) line.components.push_back(fmt::format("{}_{}", name, k + 1));
  }
  const auto append = [&](const std::string& method, int steps, const Matrix& gradient) {
    line.method = method;
    line.steps = steps;
    line.derivatives.clear();
    for (const auto& row : gradient.rowwise()) line.derivatives.emplace_back(row.begin(), row.end());
    line.error = largest_error(gradient, reference, gradient.cols());
    line.error_after_impact = largest_error(gradient, reference, n_behind);
    file.append(to_json(line));
  };
  append("reference", 0, reference);
  for (const auto& entry : document.at("methods")) {
    const std::string method = entry.at("method");
    for (const int steps : entry.at("steps").get<std::vector<int>>()) {
      append(method, steps,
             make_method(method)->info().has_sensitivities
                 ? gradient_by_sensitivities(*problem, trajectory, method, steps)
                 : gradient_by_differences(*problem, trajectory, fixed_step_solver(method, steps), kSchemeChange));
    }
  }
}

}  // namespace ricochet
