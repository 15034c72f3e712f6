#include "methods/method.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <optional>

#include "methods/islands/island_run.h"
#include "methods/regions/region_run.h"
#include "methods/regions/until_run.h"
#include "methods/step_check.h"
#include "methods/time_limit.h"
#include "problems/input_error.h"
#include "problems/regions/static_friction.h"

namespace ricochet {

namespace {

/// @throws InputError
void check(const MethodInfo& method, const ProblemInfo& problem, const Settings& settings) {
  const auto require = [](bool ok, const char* field, double value, const char* allowed) {
    if (!ok) throw InputError(field, value, allowed);
  };
  const auto in_unit_interval = [](double x) { return x > 0 && x < 1; };
  if (method.is_adaptive) {
    require(settings.tolerance >= 1e-15 && settings.tolerance < 1, "tolerance", settings.tolerance,
            "a number from 1e-15 to 1 is required");
  } else {
    require(settings.steps >= 1, "steps", settings.steps, "at least one step is required, h = T / steps > 0");
  }
  require(in_unit_interval(settings.inner_tolerance), "inner_tolerance", settings.inner_tolerance,
          "a number between 0 and 1 is required");
  require(in_unit_interval(settings.event_tolerance), "event_tolerance", settings.event_tolerance,
          "a number between 0 and 1 is required");
  if (!settings.sensitivities.empty() && !method.has_sensitivities)
    throw InputError(fmt::format("method {} computes no sensitivities", method.id));
  if (const auto law = problem.impact_law.hypothesis;
      !settings.sensitivities.empty() && law != ImpactHypothesis::newton && problem.n_c() > problem.n_bilateral())
    throw InputError("sensitivities", settings.sensitivities.front(),
                     fmt::format("none are possible through impacts of the law {}", name_of(law)));
  if (!settings.sensitivities.empty() && problem.has_static_friction())
    throw InputError("sensitivities", settings.sensitivities.front(),
                     "none are possible where a contact has another coefficient of friction while it sticks");
  require(settings.time_limit >= 0, "time_limit", settings.time_limit, "a number of seconds >= 0 is required");
}

/// The result of `run`. If the method, which may be of a plugin, throws an exception that is not allowed: a failed run
/// with the reason.
template <class Run>
Solution guarded(const Problem& problem, const Run& run) {
  try {
    return run();
  } catch (const InputError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    Solution solution;
    solution.status = Status::inner_solver_failed;
    solution.message = std::string("the method threw an exception: ") + error.what();
    solution.q = problem.info().q0;
    solution.v = problem.info().v0;
    return solution;
  }
}

/// Whether formulas bend or jump, and the method follows them region by region.
bool runs_by_regions(const MethodInfo& method, const ProblemInfo& problem) {
  return method.has_regions && !problem.switches.empty();
}

/// Whether Method has to end the run where ProblemInfo::until vanishes.
bool needs_until(const MethodInfo& method, const ProblemInfo& problem) {
  return problem.until >= 0 && !method.has_regions && !method.ends_runs;
}

/// Whether bodies that do not meet may run apart from each other.
bool has_islands(const MethodInfo& method, const Problem& problem) {
  return method.has_islands && IslandRun::is_worth_it(problem);
}

/// The settings of a run: events and grid points are recorded where complete() looks at them.
Settings with_events(Settings settings, const ProblemInfo& problem) {
  if (problem.n_friction_elements > 0) settings.recording = std::max(settings.recording, Recording::events);
  if (std::ranges::any_of(problem.contacts, &ContactInfo::mu_varies))
    settings.recording = std::max(settings.recording, Recording::grid);
  return settings;
}

constexpr double kNoAccuracy = 1e300;

/// Drops the events that nobody wanted, and checks the final state of whatever method it is. A fixed-step method has no
/// accuracy that its gaps could be compared with.
void complete(const MethodInfo& method, const Problem& problem, const Settings& settings, Solution& solution) {
  const double h = method.is_adaptive ? 0 : problem.info().end_time / settings.steps;
  fail_where_bound_is_negative(problem, h, solution);
  fail_where_friction_is_not_positive(problem, solution);
  if (settings.recording == Recording::final_state) solution.events.clear();
  if (settings.recording < Recording::grid) solution.samples.clear();
  if (!solution.succeeded()) return;
  StepCheck check(problem, method.is_adaptive ? StepCheck::kTolerances * settings.tolerance : kNoAccuracy);
  solution.status = check(solution.q, solution.q, solution.v, {});
  if (!solution.succeeded()) solution.message = fmt::format("at t = {:.6g} s: {}", solution.t, check.message());
}

}  // namespace

Support Method::can_run(const ProblemInfo& problem) const {
  const auto law = problem.impact_law.hypothesis;
  if (const auto known = info().impact_laws; std::ranges::find(known, law) == known.end())
    return Support::no(fmt::format("impacts of the scene obey the law {}, which it does not have", name_of(law)));
  if (needs_until(info(), problem) && !info().keeps_samples)
    return Support::no("it has no steps at which a run could end where a formula vanishes");
  const auto of_speed = std::ranges::find_if(
      problem.contacts, [](const ContactInfo& contact) { return contact.eps_r_of_speed != nullptr; });
  if (of_speed != problem.contacts.end() && !info().has_restitution_of_speed)
    return Support::no(
        fmt::format("e of contact '{}' depends on the approach speed vn, and it requires a number", of_speed->name));
  const auto is_static = [](const ContactInfo& contact) { return contact.mu_static != 0; };
  if (const auto found = std::ranges::find_if(problem.contacts, is_static);
      found != problem.contacts.end() && !info().has_static_friction)
    return Support::no(
        fmt::format("'{}' has another coefficient of friction while it sticks, and it does not locate "
                    "where that begins and ends",
                    found->name));
  return supports(problem);
}

void Method::require_support(const ProblemInfo& problem) const {
  if (const Support support = can_run(problem); !support.ok)
    throw InputError(fmt::format("method {} cannot run problem {}: {}", info().id, problem.id, support.reason));
}

Solution Method::solve(const Problem& problem, const Settings& settings) const {
  require_support(problem.info());
  if (problem.info().has_static_friction() || runs_by_regions(info(), problem.info()) ||
      needs_until(info(), problem.info()) || has_islands(info(), problem))
    return prepare(problem)->solve(settings);
  check(info(), problem.info(), settings);
  Solution solution = guarded(problem, [&] { return do_solve(problem, with_events(settings, problem.info())); });
  complete(info(), problem, settings, solution);
  return solution;
}

/// The checks of Method::solve() around a solver of the method, or around do_solve() where there is none.
class Method::CheckedSolver final : public Solver {
 public:
  CheckedSolver(const Method& method, const Problem& problem)
      : method_(method), info_(method.info()), problem_(problem) {
    if (problem.info().has_static_friction())
      friction_.emplace(problem, [this](const Problem& here, const StaticFrictionRun::Sticks& sticks, int steps,
                                        const EndsRun& ends) { return run_piece(here, sticks, steps, ends); });
    else if (runs_by_regions(info_, problem.info()))
      regions_.emplace(problem, info_.is_adaptive, [&method](const Problem& region) { return method.prepare(region); });
    else if (has_islands(info_, problem))
      islands_.emplace(problem, [&method](const Problem& part) { return method.do_prepare(part); });
    else
      solver_ = method.do_prepare(problem);
  }

  Solution solve(const Settings& settings) override {
    check(info_, problem_.info(), settings);
    const Settings with = with_events(settings, problem_.info());
    Solution solution = guarded(problem_, [&] {
      if (friction_) return run_by_friction(with);
      if (regions_) return regions_->solve(with);
      if (islands_ && IslandRun::can_divide(with)) return islands_->solve(with);
      if (needs_until(info_, problem_.info()))
        return run_until(problem_, with, [&](const Problem& of, const Settings& s) {
          return solver_ && &of == &problem_ ? solver_->solve(s) : method_.do_solve(of, s);
        });
      return solver_ ? solver_->solve(with) : method_.do_solve(problem_, with);
    });
    complete(info_, problem_, settings, solution);
    return solution;
  }

 private:
  Solution run_by_friction(const Settings& settings) {
    of_pieces_ = settings;
    of_pieces_.recording = std::max(settings.recording, Recording::events);
    limit_.emplace(settings.time_limit);
    return friction_->solve(info_.is_adaptive ? 0 : settings.steps);
  }

  Solution run_piece(const Problem& here, const StaticFrictionRun::Sticks& sticks, int steps, const EndsRun& ends) {
    Settings settings = of_pieces_;
    settings.steps = steps;
    settings.ends = ends;
    if (settings.time_limit > 0) settings.time_limit = std::max(1e-3, limit_->left());
    auto& solver = pieces_[sticks];
    if (!solver) solver = method_.prepare(here);
    return solver->solve(settings);
  }

  const Method& method_;
  const MethodInfo info_;
  const Problem& problem_;
  std::unique_ptr<Solver> solver_;
  std::optional<RegionRun> regions_;           // in place of solver_
  std::optional<IslandRun> islands_;           // likewise, in runs that can be divided
  std::optional<StaticFrictionRun> friction_;  // likewise; its pieces have solvers of their own
  std::map<StaticFrictionRun::Sticks, std::unique_ptr<Solver>> pieces_;
  Settings of_pieces_;
  std::optional<TimeLimit> limit_;
};

std::unique_ptr<Solver> Method::prepare(const Problem& problem) const {
  require_support(problem.info());
  return std::make_unique<CheckedSolver>(*this, problem);
}

std::unique_ptr<Solver> Method::do_prepare(const Problem&) const {
  return nullptr;
}

}  // namespace ricochet
