#include "methods/time_stepping/common/switching_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/regions/until_run.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr std::int64_t kMaxSteps = 10'000'000;
constexpr double kGapRounding = 1e-13;   // of gaps and ways
constexpr double kJump = 10;             // of the way of a step: a gap that changes more has jumped
constexpr double kTimeRounding = 1e-14;  // of the end time: steps that end this close to a time end there

}  // namespace

SwitchingRun::SwitchingRun(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
                           ContactObserver* observer, double shortest)
    : problem_(problem),
      settings_(settings),
      T_(problem.info().end_time),
      shortest_(shortest),
      longest_(std::max(shortest_, std::min(std::max(32 * shortest_, 0.1 * std::sqrt(shortest_ * T_)), 1e-3 * T_))),
      time_limit_(settings.time_limit),
      table_(problem, settings, solver, observer, solution_.counters, shortest_),
      state_(problem.info()),
      before_(state_),
      J_n_(Vector::Zero(problem.info().n_normal_entries)),
      gaps_before_{Vector::Zero(problem.n_c()), Vector::Zero(problem.n_c())},
      gaps_(gaps_before_),
      gap_search_(problem, 3),
      regions_(problem),
      single_(shortest_),
      series_end_(-T_) {}

bool SwitchingRun::fail(Status status, const std::string& why) {
  solution_.status = status;
  solution_.message = fmt::format("at t = {:.6g} s: {}", t_, why);
  return false;
}

bool SwitchingRun::can_go_on() {
  if (time_limit_.is_over()) return fail(Status::time_limit, time_limit_.message());
  if (solution_.counters.elements >= kMaxSteps) return fail(Status::step_limit, fmt::format("{} steps", kMaxSteps));
  if (!state_.q.allFinite() || !state_.v.allFinite()) return fail(Status::non_finite, "the state is not finite");
  return true;
}

Solution SwitchingRun::finish() {
  solution_.t = t_;
  solution_.q = state_.q;
  solution_.v = state_.v;
  if (settings_.audit) {
    solution_.residuals = {{.name = "contact law",
                            .formula = "r, w = G r + b in the laws of unilateral contact and friction, each step",
                            .value = table_.residual()}};
  }
  return std::move(solution_);
}

void SwitchingRun::evaluate(const MoreauExtrapolation::State& state, Gaps& gaps) {
  problem_.gap(state.q.data(), gaps.gap.data());
  problem_.normal_jacobian(state.q.data(), J_n_.data());
  for (const int i : problem_.info().unilateral) {
    const auto& contact = problem_.info().contacts[i];
    gaps.rate[i] = packed_dot(contact, J_n_.data() + contact.normal_begin, state.v.data());
  }
}

/// Whether an open contact has closed within a step of length `h` that has just been taken, and may have opened again, on
/// the cubic through the states at both ends. What is left of a penetration where it opened is none.
bool SwitchingRun::has_passed(double h) {
  const auto& unilateral = problem_.info().unilateral;
  modes_ = before_.modes;
  for (const int i : unilateral) {
    if (is_closed(state_.modes[i])) modes_[i] = state_.modes[i];
  }
  const auto is_open = [&](int i) { return !is_closed(modes_[i]); };
  if (std::ranges::none_of(unilateral, is_open)) return false;
  evaluate(before_, gaps_before_);
  evaluate(state_, gaps_);
  Matrix& path = gap_search_.path();
  path.col(0) = before_.q;
  path.col(1) = before_.q + h / 3 * before_.v;
  path.col(2) = state_.q - h / 3 * state_.v;
  path.col(3) = state_.q;
  gap_search_.begin(modes_);
  return std::ranges::any_of(unilateral, [&](int i) {
    const double left = gaps_before_.gap[i], right = gaps_.gap[i];
    if (!is_open(i)) return false;
    const double way = h * (std::abs(gaps_before_.rate[i]) + std::abs(gaps_.rate[i]));
    const double rounding = kGapRounding * (std::abs(left) + right + way);
    return bool(gap_search_.first_closing(i, {.gap = std::max(rounding, -2 * left), .rounding = rounding}));
  });
}

/// Opens closed contacts whose gap is no longer small: its formula has jumped.
void SwitchingRun::open_jumped_gaps() {
  evaluate(before_, gaps_before_);
  evaluate(state_, gaps_);
  for (const int i : problem_.info().unilateral) {
    const double way = single_ * (std::abs(gaps_before_.rate[i]) + std::abs(gaps_.rate[i]));
    if (is_closed(state_.modes[i]) && gaps_.gap[i] - gaps_before_.gap[i] > kJump * (way + shortest_))
      state_.modes[i] = ContactMode::open;
  }
}

/// Whether both sides of psi_k = 0 lead back to it at the present state.
bool SwitchingRun::slides_on(int k) {
  const ProblemInfo& info = problem_.info();
  if (info.switches[k].is_of_time || k == info.until) return false;
  Vector psi(std::ssize(info.switches));
  problem_.switching(state_.q.data(), state_.v.data(), psi.data());
  std::vector<int> signs;
  for (const double x : psi) signs.push_back(x < 0 ? -1 : 1);
  std::string why_not;
  return slides(problem_, regions_, signs, k, state_.q, state_.v, state_.modes, why_not);
}

/// q on the cubic with the velocities at both ends of a step of length `h`, s of it after its begin.
void SwitchingRun::between_ends(double h, double s, Vector& q) const {
  const double r = 1 - s;
  q = before_.q + s * (state_.q - before_.q) +
      s * r * (r * (h * before_.v - (state_.q - before_.q)) + s * ((state_.q - before_.q) - h * state_.v));
}

MoreauExtrapolation::Outcome SwitchingRun::try_step(double h, double end, int rows, double tolerance) {
  const bool is_last = t_ + h >= end - kTimeRounding * T_;
  before_ = state_;
  const auto outcome = table_.step(is_last ? end - t_ : h, rows, tolerance, state_);
  if (outcome != MoreauExtrapolation::Outcome::reached) return outcome;
  if (has_passed(is_last ? end - t_ : h)) {
    state_ = before_;
    return MoreauExtrapolation::Outcome::switches;
  }
  const double begin = t_;
  advance(is_last ? end : t_ + h);
  record_piece(begin, 3);
  return outcome;
}

bool SwitchingRun::switch_modes(double end) {
  single_ = least();
  for (bool switches = true; switches && t_ < end && !has_ended_;) {
    if (!can_go_on()) return false;
    const bool is_last = t_ + single_ >= end - kTimeRounding * T_;
    const double begin = t_;
    before_ = state_;
    if (!table_.single_step(is_last ? end - t_ : single_, state_))
      return fail(Status::inner_solver_failed, table_.reason());
    advance(is_last ? end : t_ + single_);
    if (const int k = table_.changed_branch(before_, state_); k >= 0) {
      open_jumped_gaps();
      if (slides_on(k))
        return fail(Status::infeasible,
                    fmt::format("the motion slides on {} = 0, where a formula jumps. This method does not follow that",
                                problem_.info().switches[k].formula));
    }
    record_closings(begin);
    record_piece(begin, 1);
    switches = table_.bounces() || state_.modes != before_.modes;
  }
  series_end_ = t_;
  return true;
}

/// A piece of a step ended.
void SwitchingRun::advance(double end) {
  t_ = end;
  if (problem_.info().clock >= 0)
    state_.q[problem_.info().clock] = problem_.info().start_time() + t_;  // millions of additions round
  ++solution_.counters.elements;
  has_ended_ = ends_here(settings_, t_, state_.q, state_.v);
}

void SwitchingRun::end_step() {
  ++solution_.counters.steps;
  if (settings_.recording >= Recording::grid) solution_.samples.push_back({t_, state_.q, state_.v, state_.v});
}

/// Between the ends of a step: the straight line after a switch, else the cubic with the velocities at both ends.
void SwitchingRun::record_piece(double begin, int degree) {
  if (settings_.recording != Recording::motion) return;
  const double h = t_ - begin;
  solution_.motion.add(begin, t_, degree, [&](double s, Vector& q, Vector& v) {
    const Vector dq = state_.q - before_.q;
    if (degree == 1) {
      q = before_.q + s * dq;
      v = state_.v;
      return;
    }
    const Vector a = h * before_.v - dq, b = dq - h * state_.v;
    between_ends(h, s, q);
    v = (1 / h) * (dq + (1 - 2 * s) * ((1 - s) * a + s * b) + s * (1 - s) * (b - a));
  });
}

/// @param begin  of the piece of a step, where its impulses act
void SwitchingRun::record_closings(double begin) {
  for (const int i : problem_.info().unilateral) {
    if (!table_.strikes(i)) continue;
    ++solution_.counters.events;
    if (settings_.recording != Recording::final_state)
      solution_.events.push_back(
          {begin, EventKind::impact, i, before_.q, before_.v, state_.v, table_.Lambda_n(), table_.Lambda_t(), {}, {}});
  }
}

}  // namespace ricochet
