#include "bench/studies/scale.h"

#include <fmt/format.h>

#include <ctime>

#include "bench/progress.h"
#include "bench/timing.h"
#include "methods/registry.h"
#include "problems/registry.h"
#include "reports/scale_results.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Of the size of q: time stepping lets contacts sink a little, and flying ones are farther.
constexpr double kTouches = 1e-4;

/// A run and what is needed to time it again.
struct Measured {
  ScaleRun run;
  double seconds = 0;  ///< of the first solve
  std::function<void()> again;
};

Measured solve_once(const std::shared_ptr<const Problem>& problem, const std::string& spec, const Settings& settings) {
  const std::shared_ptr<const Method> method = make_method(spec);
  Measured result;
  ScaleRun& run = result.run;
  run.method = spec;
  run.contacts = problem->n_c();
  run.steps = settings.steps;
  if (const auto supported = method->supports(problem->info()); !supported.ok) {
    run.status = "declined";
    run.message = supported.reason;
    return result;
  }
  const std::clock_t begin = std::clock();
  const Solution solution = method->solve(*problem, settings);
  result.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  run.status = to_string(solution.status);
  run.message = solution.message;
  if (!solution.succeeded()) return result;
  const double steps = static_cast<double>(solution.counters.steps);
  run.active = static_cast<int>((problem->gap(solution.q).array() < kTouches).count());
  run.solves = static_cast<double>(solution.counters.complementarity_solves) / steps;
  run.iterations = static_cast<double>(solution.counters.inner_iterations + solution.counters.pivots) / steps;
  run.events = static_cast<int>(solution.events.size());
  result.again = [problem, method, settings] { method->solve(*problem, settings); };
  return result;
}

}  // namespace

void study_scale(const json& document, ResultsFile& file) {
  Settings settings;
  settings.steps = document.at("steps");
  settings.time_limit = document.at("time_limit");
  Progress progress(document.at("id").get<std::string>());
  const json& runs = document.at("runs");
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::string id = runs[r].at("problem");
    const auto changes = runs[r].value("set", ParameterChanges());
    for (const std::string method : runs[r].at("methods")) {
      std::vector<Measured> measured;
      for (const int size : runs[r].at("sizes")) {
        ParameterChanges all = changes;
        all["n"] = size;
        std::string command =
            fmt::format("ricochet run --problem {} --method {} --steps {}", id, method, settings.steps);
        for (const auto& [name, value] : all) command += fmt::format(" --set {}={}", name, value);
        if (!measured.empty() && measured.back().run.status != "success") {
          measured.push_back({.run = {.method = method, .status = "not run", .message = "a smaller one did not end"}});
        } else {
          measured.push_back(solve_once(make_problem(id, all), method, settings));
        }
        measured.back().run.problem = id;
        measured.back().run.size = size;
        measured.back().run.command = command;
        progress.update((static_cast<double>(r) + 0.5) / static_cast<double>(runs.size()), command);
      }
      std::vector<TimedRun> timed;
      for (const auto& m : measured) {
        if (m.again) timed.push_back({m.run.command, m.seconds, m.again});
      }
      const auto timings = measure(timed, document.value("quick", false), [](double) {});
      std::size_t next = 0;
      for (auto& m : measured) {
        if (m.again) m.run.step_seconds = timings[next++].median / m.run.steps;
        file.append(to_json(m.run));
      }
    }
  }
  progress.finish();
}

}  // namespace ricochet
