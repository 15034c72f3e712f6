#include "methods/time_stepping/common/moreau_extrapolation.h"

#include <algorithm>
#include <cmath>

#include "methods/time_stepping/common/gap_rounding.h"

namespace ricochet {
namespace {

/// What a velocity of zero may be, as a part of the largest velocity: with an impulse, and without one (contacts that are
/// redundant, or fall together); by Lemke's method, by others, which iterate. What opens smoothly, or begins to slip, has a
/// velocity in proportion to h that these must not hide.
constexpr double kRest = 1e-12, kIteratedRest = 1e-11;
constexpr double kTie = 1e-14, kIteratedTie = 1e-12;
/// Flights up to this many of the least steps have an end: behind them a contact does not bounce.
constexpr double kFlights = 4;

}  // namespace

MoreauExtrapolation::MoreauExtrapolation(const Problem& problem, const Settings& settings,
                                         const ContactSolverOptions& solver, ContactObserver* observer,
                                         Counters& counters, double shortest)
    : problem_(problem),
      info_(problem.info()),
      settings_(settings),
      counters_(counters),
      shortest_(shortest),
      contacts_(problem, solver, {}, counters, observer),
      touching_(gap_rounding(problem, 0)),
      is_affine_(std::ranges::all_of(info_.contacts, &ContactInfo::is_affine)),
      rest_(options_for(info_, solver).kind == ContactSolverKind::lemke ? kRest : kIteratedRest),
      tie_(options_for(info_, solver).kind == ContactSolverKind::lemke ? kTie : kIteratedTie) {
  const int n_q = info_.n_q, n_c = info_.n_c();
  M_.resize(n_q, n_q);
  for (auto* x : {&q_m_, &f_, &Wf_}) x->setZero(n_q);
  for (auto* x : {&gap_, &shift_, &turn_}) x->setZero(n_c);
  for (auto* x : {&slip_, &slip_turn_}) x->setZero(info_.n_lambda_t);
  T_.resize(info_.n_lambda_t, n_q);
  for (auto& x : table_) x.setZero(2 * n_q);
  for (auto* x : {&x_, &y_}) x->setZero(2 * n_q);
  active_.reserve(n_c);
  strikes_.assign(n_c, false);
  if (info_.structure.constant_mass) {
    problem_.mass_matrix(info_.q0.data(), M_.data());
    W_.compute(M_, info_.has_bilateral());
    ++counters_.mass_factorizations;
  }
}

MoreauExtrapolation::Outcome MoreauExtrapolation::step(double h, int rows, double tolerance, State& state) {
  const int n_q = info_.n_q;
  rows_used_ = 0;
  tried_residual_ = 0;
  for (int j = 1; j <= rows; ++j) {
    at_ = state;
    for (int s = 0; s < j; ++s) {
      if (!substep(h / j, Rates::in_middle, at_, next_)) return Outcome::failed;
      if (bounces_ || at_.modes != next_.modes) return Outcome::switches;
      std::swap(at_, next_);
    }
    // (5), T_{j-1,i} -> T_{j,i} in place.
    x_ << at_.q, at_.v;
    for (int i = 1; i < j; ++i) {
      y_ = table_[i];
      table_[i] = x_;
      x_ += (x_ - y_) / (static_cast<double>(j) / (j - i) - 1);
    }
    table_[j] = x_;
    rows_used_ = j;
    if (j == 1 || tolerance == 0) continue;
    errors_[j] = difference(table_[j], table_[j - 1], state, tolerance);
    if (errors_[j] <= 1) break;
  }
  if (!table_[rows_used_].allFinite()) return Outcome::inaccurate;
  if (tolerance > 0 && !(errors_[rows_used_] <= 1)) return Outcome::inaccurate;
  at_.q = table_[rows_used_].head(n_q);
  at_.v = table_[rows_used_].tail(n_q);
  if (!substep(shortest_, Rates::at_end, at_, next_)) return Outcome::failed;
  if (bounces_ || at_.modes != next_.modes) return Outcome::switches;
  std::swap(state, at_);
  residual_ = std::max(residual_, tried_residual_);
  note_depths(state.modes, state);
  return Outcome::reached;
}

bool MoreauExtrapolation::single_step(double h, State& state) {
  tried_residual_ = 0;
  if (!substep(h, Rates::at_end, state, next_)) return false;
  residual_ = std::max(residual_, tried_residual_);
  note_depths(state.modes, next_);
  std::swap(state, next_);
  return true;
}

/// From the gaps of the last substep. @param before  modes before the step that ends with `state`
void MoreauExtrapolation::note_depths(const std::vector<ContactMode>& before, State& state) {
  for (const int i : info_.unilateral) {
    const bool opens = state.modes[i] == ContactMode::open && (before[i] != ContactMode::open || bounces_);
    if (opens) state.depth[i] = std::min(gap_[i], 0.0);
    if (gap_[i] > 0) state.depth[i] = 0;
  }
}

bool MoreauExtrapolation::substep(double h, Rates rates, const State& from, State& to) {
  q_m_ = from.q + (0.5 * h) * from.v;  // (1)
  if (!info_.structure.constant_mass) {
    problem_.mass_matrix(q_m_.data(), M_.data());
    W_.compute(M_, info_.has_bilateral());
    ++counters_.mass_factorizations;
  }
  problem_.force(q_m_.data(), from.v.data(), info_.u.data(), f_.data());
  W_.apply(f_, Wf_);
  ++counters_.force_evaluations;
  ++counters_.linear_solves;
  to.v = from.v + h * Wf_;
  to.depth = from.depth;
  to.flight = from.flight.array() + h;
  bounces_ = false;
  if (!solve_contacts(h, rates, from, to)) return false;
  to.q = q_m_ + (0.5 * h) * to.v;  // (4)
  return true;
}

/// (2), (3): replaces the free velocity of `to`, and sets its modes.
bool MoreauExtrapolation::solve_contacts(double h, Rates rates, const State& from, State& to) {
  active_.clear();
  std::ranges::fill(strikes_, false);
  if (info_.n_c() == 0) return true;
  problem_.gap(q_m_.data(), gap_.data());
  for (const int i : info_.unilateral) {
    to.modes[i] = ContactMode::open;
    if (gap_[i] <= touching_[i] + from.depth[i] || from.modes[i] != ContactMode::open) active_.push_back(i);
  }
  if (active_.empty() && !info_.has_bilateral()) return true;
  contacts_.set_position(q_m_);
  contacts_.set_active(active_);
  if (!is_affine_) set_turns(rates == Rates::at_end ? h : 0, from.v);
  shift_ = turn_;
  const int n = info_.n_mechanical();
  const double rest_flight = kFlights * (rates == Rates::at_end ? h : shortest_);
  const double largest = std::max(from.v.head(n).cwiseAbs().maxCoeff(), to.v.head(n).cwiseAbs().maxCoeff());
  const double rest = rest_ * largest, tie = tie_ * largest;
  for (const int i : active_) {
    const double speed = contacts_.normal_velocity(i, from.v) - turn_[i];
    const bool rests = from.modes[i] != ContactMode::open || to.flight[i] <= rest_flight || std::abs(speed) <= rest;
    strikes_[i] = !rests && speed < 0;
    if (!rests) shift_[i] += info_.contacts[i].eps_r * speed;
  }
  ContactStatus status = contacts_.set_inverse_mass(W_);
  if (status == ContactStatus::solved) status = contacts_.solve(to.v, shift_, {}, slip_turn_);
  if (status != ContactStatus::solved) {
    reason_ = contacts_.reason(status);
    return false;
  }
  if (settings_.audit) tried_residual_ = std::max(tried_residual_, contacts_.residual(to.v, shift_, slip_turn_));
  contacts_.slip_velocities(to.v, slip_);
  slip_ += slip_turn_;
  for (const int i : active_) {
    const double speed = contacts_.normal_velocity(i, to.v) + turn_[i];
    const bool is_pressed = contacts_.Lambda_n()[i] > 0;
    if (is_pressed) to.flight[i] = 0;
    strikes_[i] = is_pressed && strikes_[i];
    const bool is_closed = speed <= (is_pressed ? rest : tie);
    bounces_ = bounces_ || (is_pressed && !is_closed);
    if (is_closed) to.modes[i] = mode_of(i, rest);
  }
  return true;
}

/// (6)
void MoreauExtrapolation::set_turns(double h, const Vector& v) {
  turn_.setZero();
  slip_turn_.setZero();
  if (h == 0) return;
  problem_.gap_acceleration_bias(q_m_.data(), v.data(), turn_.data());
  turn_ *= 0.5 * h;
  if (!info_.has_friction()) return;
  problem_.slip_velocity_derivative(q_m_.data(), v.data(), T_.data());
  slip_turn_.noalias() = (0.5 * h) * T_.lazyProduct(v);
}

/// Of a contact that is closed. @param still  what a velocity of zero may be
ContactMode MoreauExtrapolation::mode_of(int contact, double still) const {
  const ContactInfo& info = info_.contacts[contact];
  if (info.n_t == 0) return ContactMode::closed;
  const auto slip = slip_.segment(info.tangent_index, info.n_t);
  if (slip.norm() <= still) return ContactMode::stick;
  if (info.n_t == 2) return ContactMode::slip;
  return slip[0] > 0 ? ContactMode::slip_positive : ContactMode::slip_negative;
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
