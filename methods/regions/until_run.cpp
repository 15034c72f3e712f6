#include "methods/regions/until_run.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

#include "methods/regions/border_search.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/regions/region_problems.h"
#include "problems/run_pieces.h"

namespace ricochet {
namespace {

constexpr double kRounding = 1e-12;  // of the terms of psi: it has no sign yet
constexpr double kZero = 4e-16;      // of the terms of psi: the end is located
constexpr double kResolved = 1e-15;  // of the end time

/// Gives the watch the grid of a run that did not call it.
void search_grid(const Solution& solution, UntilWatch& watch) {
  for (const Sample& sample : solution.samples) {
    if (sample.t > 0 && watch.ends(sample.t, sample.q, sample.v_plus)) return;
  }
}

/// Removes the part of the run after `t` [s].
void keep_until(double t, Solution& solution) {
  solution.counters.events -=
      static_cast<std::int64_t>(std::erase_if(solution.events, [&](const Event& event) { return event.t > t; }));
  std::erase_if(solution.samples, [&](const Sample& sample) { return sample.t > t; });
  solution.motion.cut(t);
  solution.cut_groups(t);
}

}  // namespace

UntilWatch::UntilWatch(const Problem& problem)
    : problem_(problem), values_(std::ssize(problem.info().switches)), q_(problem.info().q0), v_(problem.info().v0) {
  find_sign(q_, v_);
  psi_begin_ = psi(q_, v_);
}

double UntilWatch::psi(const Vector& q, const Vector& v) {
  problem_.switching(q.data(), v.data(), values_.data());
  return sign_ * values_[problem_.info().until];
}

double UntilWatch::size(const Vector& q, const Vector& v) const {
  return problem_.switching_sizes(q, v)[problem_.info().until];
}

void UntilWatch::find_sign(const Vector& q, const Vector& v) {
  sign_ = 1;
  const double value = psi(q, v);
  sign_ = std::abs(value) <= kRounding * size(q, v) ? 0 : value < 0 ? -1 : 1;
}

bool UntilWatch::ends(double t, const Vector& q, const Vector& v) {
  was_called_ = true;
  if (has_ended_) return true;
  if (sign_ == 0) find_sign(q, v);
  const double value = psi(q, v);
  if (value < 0) {
    has_ended_ = true;
    end_ = t;
    psi_end_ = value;
    return true;
  }
  begin_ = t;
  q_ = q;
  v_ = v;
  psi_begin_ = value;
  return false;
}

Solution run_until(const Problem& problem, const Settings& settings,
                   const std::function<Solution(const Problem&, const Settings&)>& run) {
  if (!settings.sensitivities.empty())
    throw InputError("sensitivities", settings.sensitivities.front(),
                     "this method has none of runs that end where a formula vanishes");
  UntilWatch watch(problem);
  Settings watched = settings;
  watched.until = &watch;
  watched.recording = std::max(settings.recording, Recording::grid);
  Solution whole = run(problem, watched);
  if (!watch.was_called()) search_grid(whole, watch);
  if (settings.recording < Recording::grid) whole.samples.clear();
  if (!watch.has_ended() || (!whole.succeeded() && whole.t < watch.end())) return whole;

  keep_until(watch.begin(), whole);
  whole.t = watch.begin();
  whole.q = watch.q();
  whole.v = watch.v();
  const double zero = kZero * watch.size(whole.q, whole.v);
  if (watch.inside() <= zero && whole.t > 0) return whole;
  std::unique_ptr<Problem> last_step;
  {
    const std::lock_guard lock(formulas_mutex());
    last_step = problem.without_until();
  }
  last_step->set_initial_state(whole.q, whole.v);
  Settings of_step = settings;
  of_step.until = nullptr;  // of a method around this one
  of_step.steps = 1;
  BorderPiece piece = search_border(
      {.function = problem.info().until,
       .inside = 0,
       .outside = watch.end() - watch.begin(),
       .psi_inside = watch.inside(),
       .psi_outside = watch.outside()},
      zero, kResolved * problem.info().end_time,
      [&](double h) {
        last_step->set_end_time(h);
        return run(*last_step, of_step);
      },
      [&](const Solution& solution) { return watch.psi(solution.q, solution.v); });
  std::vector<ContactMode> modes;
  append(problem.info(), std::move(piece.solution), whole, modes);
  const std::lock_guard lock(formulas_mutex());
  last_step.reset();
  return whole;
}

}  // namespace ricochet
