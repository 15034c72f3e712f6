#include "methods/time_stepping/common/moreau_extrapolation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ricochet {

MoreauExtrapolation::MoreauExtrapolation(const Problem& problem, const Settings& settings,
                                         const ContactSolverOptions& solver, ContactObserver* observer,
                                         Counters& counters, double shortest)
    : info_(problem.info()),
      shortest_(shortest),
      midpoint_(problem, settings, solver, observer, counters, shortest),
      branch_(problem),
      at_(info_),
      next_(info_),
      table_(2 * info_.n_q) {}

/// A step to next_.
bool MoreauExtrapolation::substep(double h, Rates rates, const State& from) {
  const bool is_solved = midpoint_.step(h, rates, from, next_);
  tried_residual_ = std::max(tried_residual_, midpoint_.residual());
  return is_solved;
}

MoreauExtrapolation::Outcome MoreauExtrapolation::step(double h, int rows, double tolerance, State& state) {
  table_.clear();
  tried_residual_ = 0;
  branch_.begin(state.q, state.v);
  for (int j = 1; j <= rows; ++j) {
    at_ = state;
    for (int s = 0; s < j; ++s) {
      if (!substep(h / j, Rates::in_middle, at_)) return Outcome::failed;
      if (switches() || branch_.changes(next_.q, next_.v)) return Outcome::switches;
      std::swap(at_, next_);
    }
    table_.next() << at_.q, at_.v;
    table_.extrapolate();
    if (j == 1 || tolerance == 0) continue;
    errors_[j] = difference(table_.best(), table_.before(), state, tolerance);
    if (errors_[j] <= 1) break;
  }
  if (!table_.best().allFinite()) return Outcome::inaccurate;
  if (tolerance > 0 && !(errors_[table_.rows()] <= 1)) return Outcome::inaccurate;
  at_.q = table_.best().head(info_.n_q);
  at_.v = table_.best().tail(info_.n_q);
  if (!substep(shortest_, Rates::at_end, at_)) return Outcome::failed;
  if (switches() || branch_.changes(at_.q, at_.v)) return Outcome::switches;
  std::swap(state, at_);
  residual_ = std::max(residual_, tried_residual_);
  note_depths(state.modes, state);
  return Outcome::reached;
}

int MoreauExtrapolation::changed_branch(const State& from, const State& to) {
  branch_.begin(from.q, from.v);
  return branch_.changes(to.q, to.v) ? branch_.changed() : -1;
}

bool MoreauExtrapolation::single_step(double h, State& state) {
  tried_residual_ = 0;
  if (!substep(h, Rates::at_end, state)) return false;
  residual_ = std::max(residual_, tried_residual_);
  note_depths(state.modes, next_);
  std::swap(state, next_);
  return true;
}

/// From the gaps of the last substep. @param before  modes before the step that ends with `state`
void MoreauExtrapolation::note_depths(const std::vector<ContactMode>& before, State& state) const {
  const Vector& gap = midpoint_.gap();
  for (const int i : info_.unilateral) {
    const bool opens = state.modes[i] == ContactMode::open && (before[i] != ContactMode::open || midpoint_.bounces());
    if (opens) state.depth[i] = std::min(gap[i], 0.0);
    if (gap[i] > 0) state.depth[i] = 0;
  }
}

/// Root mean square of x - y in parts of tolerance (1 + |state|).
double MoreauExtrapolation::difference(const Vector& x, const Vector& y, const State& at, double tolerance) const {
  const int n_q = info_.n_q;
  double sum = 0;
  for (int k = 0; k < n_q; ++k) {
    const double e_q = (x[k] - y[k]) / (1 + std::abs(at.q[k])),
                 e_v = (x[n_q + k] - y[n_q + k]) / (1 + std::abs(at.v[k]));
    sum += e_q * e_q + e_v * e_v;
  }
  return std::sqrt(sum / (2 * n_q)) / tolerance;
}

}  // namespace ricochet
