#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "bench/measure/allocations.h"
#include "bench/studies/verify/check.h"
#include "bench/studies/verify/promises.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kClock = 1e-9;       // an unknown among others has the tolerance of its solver
constexpr double kRecording = 1e-11;  // rounding of a thousand steps, which an impact makes larger
constexpr double kTolerance = 1e-8;   // of error-controlled methods in these checks
constexpr int kFirstOrderSteps = 1600, kSteps = 400;
/// An event that is recorded keeps five vectors, and the list of events may grow.
constexpr std::int64_t kAllocationsPerEvent = 6;

Setting setting_of(const Subject& subject) {
  return subject.setting(kFirstOrderSteps, kSteps, kTolerance);
}

Settings settings_of(const Subject& subject) {
  Settings settings;
  settings.steps = setting_of(subject).steps;
  settings.tolerance = setting_of(subject).tolerance;
  return settings;
}

std::string command_of(const ProblemChoice& choice, const Subject& subject) {
  return subject.planned(choice, setting_of(subject)).command();
}

CheckResult keeps_promises(const KnownProblem& known, const Subject& subject) {
  const auto method = make_method(subject.spec);
  if (const Support support = method->can_run(known.problem().info()); !support.ok)
    return CheckResult::not_applicable(support.reason);
  Settings settings = settings_of(subject);
  settings.time_limit = subject.time_limit / 4;  // there are three runs
  const std::string command = command_of(known.choice(), subject);
  try {
    const PromisedRun run =
        run_as_promised(*method, known.problem(), settings, {.clock = kClock, .recording = kRecording});
    if (!run.broken.empty()) return CheckResult::fail(fmt::format("{}", fmt::join(run.broken, "; ")), command);
    if (!run.solution.succeeded())  // no promise is broken by that; orders and truth ask for success
      return CheckResult::pass(
          fmt::format("ends at t = {:.4g} of {:g} s with a reason, {}: {}", run.solution.t,
                      known.problem().info().end_time, to_string(run.solution.status), run.solution.message),
          command);
    return CheckResult::pass(fmt::format("{} events; twice the same bits", run.solution.events.size()), command);
  } catch (const InputError& error) {
    return CheckResult::not_applicable(error.what());
  }
}

/// A run of a kept solver knows nothing of the one before it.
CheckResult kept_solver_forgets(const KnownProblem& known, const Subject& subject) {
  const auto method = make_method(subject.spec);
  if (const Support support = method->can_run(known.problem().info()); !support.ok)
    return CheckResult::not_applicable(support.reason);
  const Settings settings = settings_of(subject);
  Settings other = settings;
  other.steps *= 2;
  other.tolerance *= 10;
  const std::string command = command_of(known.choice(), subject);
  const auto solver = method->prepare(known.problem());
  const Solution first = solver->solve(settings);
  solver->solve(other);
  const Solution again = solver->solve(settings);
  if (first.status != again.status || !same_bits(first.q, again.q) || !same_bits(first.v, again.v))
    return CheckResult::fail("after a run with other settings the solver has another result", command);
  return CheckResult::pass("the same bits after a run with other settings", command);
}

/// The message with which the method refuses; empty where it does not.
std::string refusal(const Method& method, const Problem& problem, const Settings& settings) {
  try {
    method.solve(problem, settings);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

CheckResult refuses_bad_settings(const KnownProblem& known, const Subject& subject) {
  const auto method = make_method(subject.spec);
  if (const Support support = method->can_run(known.problem().info()); !support.ok)
    return CheckResult::not_applicable(support.reason);
  const double nan = std::nan("");
  std::vector<std::pair<std::string, Settings>> bad;
  const auto add = [&](const std::string& text, const auto& change) {
    Settings settings = settings_of(subject);
    change(settings);
    bad.emplace_back(text, settings);
  };
  if (setting_of(subject).is_tolerance()) {
    for (const double tolerance : {0.0, -1e-6, 2.0, nan})
      add(fmt::format("tolerance = {:g}", tolerance), [=](Settings& s) { s.tolerance = tolerance; });
  } else {
    for (const int steps : {0, -5}) add(fmt::format("steps = {}", steps), [=](Settings& s) { s.steps = steps; });
  }
  for (const double limit : {-1.0, nan})
    add(fmt::format("time_limit = {:g}", limit), [=](Settings& s) { s.time_limit = limit; });
  std::vector<std::string> taken;
  for (const auto& [text, settings] : bad) {
    if (refusal(*method, known.problem(), settings).empty()) taken.push_back(text);
  }
  if (taken.empty()) return CheckResult::pass(fmt::format("{} settings out of range are refused", bad.size()));
  return CheckResult::fail(fmt::format("taken without an error: {}", fmt::join(taken, ", ")));
}

/// Problems that supports() declines are refused by solve(), and both state the reason.
CheckResult refuses_what_it_declines(const std::vector<std::shared_ptr<KnownProblem>>& scenes, const Subject& subject) {
  const auto method = make_method(subject.spec);
  int declined = 0;
  for (const auto& known : scenes) {
    const Support support = method->can_run(known->problem().info());
    if (support.ok) continue;
    ++declined;
    if (support.reason.empty()) return CheckResult::fail(known->choice().problem + ": declined without a reason");
    if (refusal(*method, known->problem(), settings_of(subject)).empty())
      return CheckResult::fail(known->choice().problem + ": declined by supports(), and solved");
  }
  if (declined == 0) return CheckResult::not_applicable("it takes every scene of the battery");
  return CheckResult::pass(fmt::format("{} scenes are declined with a reason, and refused", declined));
}

/// Allocations of a run depend on its events, not on its steps: many steps need no more than few.
CheckResult allocates_nothing(const KnownProblem& known, const Subject& subject) {
  if (!subject.info.is_allocation_free) return CheckResult::not_applicable("it does not claim that");
  if (!counts_allocations()) return CheckResult::not_applicable("this build of the program does not count allocations");
  const auto method = make_method(subject.spec);
  if (const Support support = method->can_run(known.problem().info()); !support.ok)
    return CheckResult::not_applicable(support.reason);
  struct Count {
    std::int64_t allocations, steps, events;
  };
  const auto count = [&](double finer) -> Count {
    Settings settings = settings_of(subject);
    settings.steps = static_cast<int>(settings.steps * finer);
    settings.tolerance /= finer * finer * finer * finer;
    method->solve(known.problem(), settings);  // the first run of a thread sizes the scratch of the problem's programs
    Solution solution;
    const std::int64_t allocations = allocations_of([&] { solution = method->solve(known.problem(), settings); }).count;
    return {solution.succeeded() ? allocations : -1, solution.counters.steps, solution.counters.events};
  };
  const Count few = count(1), many = count(2);
  if (few.allocations < 0 || many.allocations < 0) return CheckResult::not_applicable("the run fails");
  const std::string text =
      fmt::format("{} allocations in {} steps, {} in {}", few.allocations, few.steps, many.allocations, many.steps);
  const std::int64_t more = kAllocationsPerEvent * std::max<std::int64_t>(0, many.events - few.events);
  return many.allocations <= few.allocations + more ? CheckResult::pass(text) : CheckResult::fail(text);
}

}  // namespace

void add_promise_checks(const json& experiment, std::vector<Check>& battery) {
  std::vector<std::shared_ptr<KnownProblem>> scenes;
  const auto add = [&](const char* group, const std::string& name, const auto& check,
                       const std::shared_ptr<KnownProblem>& known) {
    battery.push_back({group, name, [known] { known->problem(); },
                       [check, known](const Subject& subject) { return check(*known, subject); }});
  };
  for (const std::string scene : experiment.at("promises")) {
    scenes.push_back(std::make_shared<KnownProblem>(read_problem_choice(json{{"problem", scene}})));
    add("promises", scene, keeps_promises, scenes.back());
  }
  if (scenes.empty()) throw InputError("promises", 0, "one scene at least is required");
  add("promises", "a kept solver forgets", kept_solver_forgets, scenes.front());
  add("bad input", "settings out of range", refuses_bad_settings, scenes.front());
  battery.push_back({"bad input", "scenes that it declines",
                     [scenes] {
                       for (const auto& known : scenes) known->problem();
                     },
                     [scenes](const Subject& subject) { return refuses_what_it_declines(scenes, subject); }});
  for (const std::string scene : experiment.at("allocation"))
    add("allocation", scene, allocates_nothing,
        std::make_shared<KnownProblem>(read_problem_choice(json{{"problem", scene}})));
}

}  // namespace ricochet
