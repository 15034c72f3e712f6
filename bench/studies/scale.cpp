#include "bench/studies/scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "bench/progress.h"
#include "bench/timing.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "problems/registry.h"
#include "reports/scale_results.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Of the size of q: time stepping lets contacts sink a little, and flying ones are farther.
constexpr double kTouches = 1e-4;

// Runs up to this CPU time [s] are repeated, longer ones are timed once.
constexpr double kRepeated = 2;

/// A run that is to be made, and what is needed to time it again.
struct Planned {
  ScaleRun run;
  std::string problem;
  ParameterChanges changes;
  double seconds = 0;           ///< of the first solve
  std::function<void()> again;  ///< of a run that is repeated
};

/// One scene of growing size and one method.
using Curve = std::vector<Planned>;

std::vector<Curve> read_curves(const json& document) {
  const int steps = document.at("steps");
  if (steps < 1) throw InputError("steps", steps, "a number >= 1 is required");
  std::vector<Curve> curves;
  for (const json& group : document.at("runs")) {
    static const std::vector<std::string> known = {"problem", "scene", "set", "set_per_n", "sizes", "methods"};
    for (const auto& [key, value] : group.items()) {
      if (std::ranges::find(known, key) == known.end()) throw_unknown_name("field of runs", key, known);
    }
    const std::string problem = group.at("problem");
    for (const std::string method : group.at("methods")) {
      make_method(method);  // a bad one throws here
      Curve curve;
      for (const int size : group.at("sizes")) {
        Planned next;
        next.problem = problem;
        next.changes = group.value("set", ParameterChanges());
        for (const auto& [name, value] : group.value("set_per_n", ParameterChanges()))
          next.changes[name] = value * size;
        next.changes["n"] = size;
        std::string command = fmt::format("ricochet run --problem {} --method {} --steps {}", problem, method, steps);
        for (const auto& [name, value] : next.changes) command += fmt::format(" --set {}={}", name, value);
        next.run = {
            .scene = group.value("scene", problem), .method = method, .command = command, .size = size, .steps = steps};
        curve.push_back(std::move(next));
      }
      if (curve.empty()) throw InputError("sizes", "[]", "at least one is required");
      make_problem(problem, curve.front().changes);
      curves.push_back(std::move(curve));
    }
  }
  return curves;
}

void solve_once(const Settings& settings, Planned& planned) {
  ScaleRun& run = planned.run;
  const std::shared_ptr<const Problem> problem = make_problem(planned.problem, planned.changes);
  const std::shared_ptr<const Method> method = make_method(run.method);
  run.contacts = problem->n_c();
  if (const auto supported = method->supports(problem->info()); !supported.ok) {
    run.status = "declined";
    run.message = supported.reason;
    return;
  }
  const std::clock_t begin = std::clock();
  const Solution solution = method->solve(*problem, settings);
  planned.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  run.status = to_string(solution.status);
  run.message = solution.message;
  if (!solution.succeeded()) return;
  const double steps = static_cast<double>(solution.counters.steps);
  run.step_seconds = planned.seconds / run.steps;
  run.active = static_cast<int>((problem->gap(solution.q).array() < kTouches).count());
  run.solves = static_cast<double>(solution.counters.complementarity_solves) / steps;
  run.iterations = static_cast<double>(solution.counters.inner_iterations + solution.counters.pivots) / steps;
  run.events = static_cast<int>(solution.counters.events);
  if (planned.seconds <= kRepeated) planned.again = [problem, method, settings] { method->solve(*problem, settings); };
}

}  // namespace

void study_scale(const json& document, ResultsFile& file) {
  std::vector<Curve> curves = read_curves(document);
  Settings settings;
  settings.steps = document.at("steps");
  settings.time_limit = document.at("time_limit");
  settings.recording = Recording::final_state;  // n contacts that close at once would be n^2 numbers
  const auto is_known = [&](const Planned& planned) {
    return std::ranges::any_of(file.taken_over().scale_runs,
                               [&](const ScaleRun& r) { return r.command == planned.run.command; });
  };
  double rows = 0, done = 0;
  for (const Curve& curve : curves) rows += static_cast<double>(curve.size());
  Progress progress(document.at("id").get<std::string>());
  for (Curve& curve : curves) {
    if (std::ranges::all_of(curve, is_known)) {
      done += static_cast<double>(curve.size());
      continue;
    }
    bool ended = true;
    std::vector<TimedRun> timed;
    for (Planned& planned : curve) {
      progress.update(done++ / rows, planned.run.command);
      if (ended) {
        solve_once(settings, planned);
      } else {
        planned.run.status = "not run";
        planned.run.message = "a smaller one did not end";
      }
      ended = planned.run.succeeded();
      if (planned.again) timed.push_back({planned.run.command, planned.seconds, planned.again});
    }
    const auto timings = measure(timed, document.value("quick", false), [](double) {});
    auto timing = timings.begin();
    for (Planned& planned : curve) {
      if (planned.again) planned.run.step_seconds = (timing++)->median / planned.run.steps;
      if (!is_known(planned)) file.append(to_json(planned.run));
    }
  }
  progress.finish();
}

}  // namespace ricochet
