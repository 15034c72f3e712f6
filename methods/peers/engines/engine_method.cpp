#include "methods/peers/engines/engine_method.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "methods/isolated.h"
#include "methods/regions/until_run.h"
#include "methods/time_limit.h"

namespace ricochet {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::vector<double> numbers_of(const Vector& x) {
  return {x.begin(), x.end()};
}
Vector vector_of(const Json& numbers) {
  const auto all = numbers.get<std::vector<double>>();
  return Eigen::Map<const Vector>(all.data(), static_cast<Eigen::Index>(all.size()));
}

/// One run in this process.
Solution run_here(const EngineEntry& engine, const EngineSettings& engine_settings, const Problem& problem,
                  const Settings& settings) {
  const EngineScene scene(problem);
  const ProblemInfo& info = problem.info();
  const double h = info.end_time / settings.steps;
  std::vector<BodyState> states = scene.states_of(info.q0, info.v0);
  const auto world = engine.make(scene, engine_settings, states, h);
  const bool keeps_grid = settings.recording >= Recording::grid;
  const bool follows_angles = [&] {  // whose turns are counted by steps
    for (int i = 0; i < scene.n_bodies(); ++i) {
      if (scene.turns(i)) return true;
    }
    return false;
  }();

  Solution s;
  s.q = info.q0;
  s.v = info.v0;
  if (keeps_grid) s.samples.push_back({0, s.q, s.v, s.v});
  const TimeLimit limit(settings.time_limit);
  const auto begin = Clock::now();
  for (int step = 1; step <= settings.steps; ++step) {
    world->step();
    ++s.counters.steps;
    s.t = step * h;
    if (keeps_grid || follows_angles || step == settings.steps || settings.until) {
      world->read(states);
      scene.coordinates_of(states, h, s.q, s.v);
    }
    if (keeps_grid) s.samples.push_back({s.t, s.q, s.v, s.v});
    if (ends_here(settings, s.t, s.q, s.v)) break;
    if (limit.is_over()) {
      s.status = Status::time_limit;
      s.message = limit.message();
      break;
    }
  }
  s.own_seconds = seconds_since(begin);
  if (const std::string complaint = world->complaint(); !complaint.empty()) {
    s.status = Status::inner_solver_failed;
    s.message = complaint;
  } else if (!s.q.allFinite() || !s.v.allFinite()) {
    s.status = Status::non_finite;
    s.message = "a state that is no number";
  }
  return s;
}

std::string bytes_of(const Solution& s) {
  Json samples = Json::array();
  for (const Sample& sample : s.samples) samples.push_back({sample.t, numbers_of(sample.q), numbers_of(sample.v_plus)});
  const auto packed = Json::to_msgpack({{"status", static_cast<int>(s.status)},
                                        {"message", s.message},
                                        {"t", s.t},
                                        {"q", numbers_of(s.q)},
                                        {"v", numbers_of(s.v)},
                                        {"steps", s.counters.steps},
                                        {"seconds", s.own_seconds},
                                        {"samples", samples}});
  return {packed.begin(), packed.end()};
}

Solution solution_of(const std::string& bytes) {
  const Json answer = Json::from_msgpack(bytes);
  Solution s;
  s.status = static_cast<Status>(answer.at("status").get<int>());
  s.message = answer.at("message");
  s.t = answer.at("t");
  s.q = vector_of(answer.at("q"));
  s.v = vector_of(answer.at("v"));
  s.counters.steps = answer.at("steps");
  s.own_seconds = answer.at("seconds");
  for (const Json& sample : answer.at("samples")) {
    const Vector v = vector_of(sample[2]);
    s.samples.push_back({sample[0], vector_of(sample[1]), v, v});
  }
  return s;
}

/// The first run, with the median time of enough runs.
Solution run_until_timed(const EngineEntry& engine, const EngineSettings& engine_settings, const Problem& problem,
                         const Settings& settings) {
  constexpr double kShort = 0.02;  // [s]; what is shorter is disturbed by whatever the process meets for the first time
  constexpr int kMostRuns = 7;
  Solution first = run_here(engine, engine_settings, problem, settings);
  std::vector<double> times{first.own_seconds};
  double total = first.own_seconds;
  while (first.succeeded() && total < kShort && static_cast<int>(times.size()) < kMostRuns) {
    times.push_back(run_here(engine, engine_settings, problem, settings).own_seconds);
    total += times.back();
  }
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  first.own_seconds = times[times.size() / 2];
  return first;
}

}  // namespace

Solution run_engine(const EngineEntry& engine, const EngineSettings& engine_settings, const Problem& problem,
                    const Settings& settings) {
  // An engine keeps settings and states in global variables, and may abort: it gets a process of its own.
  const double patience = settings.time_limit > 0 ? settings.time_limit + 5 : kNoLimit;
  const IsolatedResult result =
      run_isolated([&] { return bytes_of(run_until_timed(engine, engine_settings, problem, settings)); }, patience);
  if (result.ending == IsolatedResult::Ending::returned) return solution_of(result.text);
  Solution failed;
  failed.q = problem.info().q0;
  failed.v = problem.info().v0;
  const bool is_late = result.ending == IsolatedResult::Ending::killed;
  failed.status = is_late ? Status::time_limit : Status::inner_solver_failed;
  failed.message = is_late ? fmt::format("killed after {:.6g} s", patience)
                           : fmt::format("{} ended its process: {}", engine.library, result.text);
  return failed;
}

std::vector<double> engine_gaps(const EngineEntry& engine, const EngineSettings& engine_settings,
                                const Problem& problem) {
  const IsolatedResult result = run_isolated(
      [&] {
        const EngineScene scene(problem);
        const auto states = scene.states_of(problem.info().q0, problem.info().v0);
        const auto packed = Json::to_msgpack(engine.make(scene, engine_settings, states, 1e-3)->gaps());
        return std::string(packed.begin(), packed.end());
      },
      kNoLimit);
  if (result.ending != IsolatedResult::Ending::returned) throw std::runtime_error(result.text);
  return Json::from_msgpack(result.text).get<std::vector<double>>();
}

}  // namespace ricochet
