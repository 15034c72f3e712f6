#include "bench/studies/control_growth.h"

#include <fmt/format.h>

#include <random>

#include "bench/control_options.h"
#include "bench/progress.h"
#include "methods/control/shrinking_horizon.h"
#include "reports/control_growth.h"

namespace ricochet {
namespace {

using nlohmann::json;

ControlGrowth measure(const std::string& arguments, double disturbance) {
  const ControlOptions options = ControlOptions::parse(arguments);
  const auto problem = options.make_problem();
  const auto transcription = options.make_transcription(*problem);
  ShrinkingHorizon horizon(*problem, *transcription, options.homotopy_options());
  const MpccSolution solution = horizon.solve();

  ControlGrowth result;
  result.problem = problem->id;
  result.command = fmt::format("ricochet mpc {} --updates 1 --disturbance {}", arguments, disturbance);
  result.intervals = problem->n_intervals;
  result.variables = transcription->mpcc().nlp.n_variables();
  result.pairs = static_cast<int>(transcription->mpcc().pairs.size());
  result.status = to_string(solution.status);
  result.message = solution.message;
  result.iterations = solution.iterations;
  result.seconds = solution.seconds;
  result.derivative_seconds = solution.derivative_seconds;
  for (const auto& step : solution.steps)
    result.steps.push_back({step.sigma, step.iterations, step.seconds, step.complementarity, is_solved(step.status)});
  if (!solution.succeeded()) return result;

  const Status plant = horizon.advance();
  result.again_status = fmt::format("plant: {}", to_string(plant));
  if (plant != Status::success) return result;
  std::mt19937 random(options.exploration.seed);
  horizon.disturb(disturbance, random);
  const MpccSolution again = horizon.resolve();
  result.again_status = to_string(again.status);
  result.again_kept_branch = again.kept_branch;
  result.again_iterations = again.iterations;
  result.again_seconds = again.seconds;
  return result;
}

}  // namespace

void measure_growth(const json& document, ResultsFile& file) {
  Progress progress(document.at("id").get<std::string>());
  std::vector<std::string> commands;
  for (const auto& run : document.at("runs")) {
    const std::string command =
        fmt::format("{} {}", run.at("problem").get<std::string>(), run.at("arguments").get<std::string>());
    if (!run.contains("intervals")) commands.push_back(command);
    for (const int N : run.value("intervals", std::vector<int>()))
      commands.push_back(fmt::format("{} --intervals {}", command, N));
  }
  const double disturbance = document.at("disturbance");
  for (std::size_t i = 0; i < commands.size(); ++i) {
    file.append(to_json(measure(commands[i], disturbance)));
    progress.update(static_cast<double>(i + 1) / static_cast<double>(commands.size()), commands[i]);
  }
}

}  // namespace ricochet
