#include "bench/studies/control_seeds.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>

#include "bench/control_options.h"
#include "bench/progress.h"
#include "bench/replay.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kSeedReplayTolerance = 1e-9;

/// Runs that are still to be made: everything but the results.
std::vector<SeedRun> runs_of(const json& document) {
  std::vector<SeedRun> runs;
  for (std::size_t k = 0; k < document.at("runs").size(); ++k) {
    const json& entry = document["runs"][k];
    const auto field = [&](const std::string& name) { return fmt::format("runs[{}].{}", k, name); };
    static const std::vector<std::string> known = {"problem", "arguments", "seeds", "time_limit"};
    for (const auto& [key, value] : entry.items()) {
      if (std::ranges::find(known, key) == known.end()) throw_unknown_name("field of runs", key, known);
    }
    const int n_seeds = entry.at("seeds");
    if (n_seeds < 1) throw InputError(field("seeds"), n_seeds, "a number >= 1 is required");
    const double time_limit = entry.at("time_limit");
    if (!(time_limit > 0)) throw InputError(field("time_limit"), time_limit, "a number > 0 is required");
    SeedRun run;
    run.problem = entry.at("problem");
    run.arguments = fmt::format("{} --time-limit {:g}", entry.at("arguments").get<std::string>(), time_limit);
    for (const char* option : {"--seed", "--time-limit"}) {
      if (entry["arguments"].get<std::string>().find(option) != std::string::npos)
        throw InputError(field("arguments"), entry["arguments"].get<std::string>(),
                         fmt::format("no {}, which is set for each run, is required", option));
    }
    ControlOptions::parse(fmt::format("{} {}", run.problem, run.arguments)).make_problem();  // bad ones throw here
    for (int seed = 1; seed <= n_seeds; ++seed) {
      run.seed = static_cast<unsigned>(seed);
      runs.push_back(run);
    }
  }
  return runs;
}

/// Solves, and fills in the results.
void solve(SeedRun& run) {
  const ControlOptions options =
      ControlOptions::parse(fmt::format("{} {} --seed {}", run.problem, run.arguments, run.seed));
  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t cpu_begin = std::clock();
  const auto problem = options.make_problem();
  const auto transcription = options.make_transcription(*problem);
  const MpccSolution solution = Homotopy(options.homotopy_options()).solve(transcription->mpcc());
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.cpu_seconds = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
  run.status = to_string(solution.status);
  run.message = solution.message;
  run.iterations = solution.iterations;
  run.terminal = std::numeric_limits<double>::quiet_NaN();
  if (!solution.succeeded()) return;

  const ControlTrajectory trajectory = transcription->trajectory(solution.x);
  run.cost = trajectory.objective;
  run.stationarity = to_string(solution.stationarity);
  run.is_b_stationary = solution.is_b_stationary;
  const Replay truth = replay(*problem, trajectory, pivoting_solver(kSeedReplayTolerance));
  run.replay_status = to_string(truth.status);
  if (truth.status == Status::success) run.terminal = mismatch(*problem, trajectory, truth).terminal;
}

}  // namespace

void study_seeds(const json& document, ResultsFile& file) {
  std::vector<SeedRun> runs = runs_of(document);
  const auto& done = file.taken_over().seed_runs;
  Progress progress(document.at("id").get<std::string>());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const bool is_done = std::ranges::any_of(done, [&](const SeedRun& r) { return r.command() == runs[k].command(); });
    if (!is_done) {
      solve(runs[k]);
      file.append(to_json(runs[k]));
    }
    progress.update(static_cast<double>(k + 1) / static_cast<double>(runs.size()), runs[k].problem);
  }
}

}  // namespace ricochet
