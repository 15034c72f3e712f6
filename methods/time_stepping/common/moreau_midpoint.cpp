#include "methods/time_stepping/common/moreau_midpoint.h"

#include <algorithm>
#include <cmath>

#include "methods/time_stepping/common/gap_rounding.h"

namespace ricochet {
namespace {

/// Bound of velocities that count as zero, as a part of the largest velocity: with an impulse, and without one (contacts
/// that are redundant, or fall together); by Lemke's method, by others, which iterate. A contact that opens smoothly or begins
/// to slip has a velocity in proportion to h, which must be larger.
constexpr double kRest = 1e-12, kIteratedRest = 1e-11;
constexpr double kTie = 1e-14, kIteratedTie = 1e-12;
/// Flights up to this many of the least steps have an end: after them a contact does not bounce.
constexpr double kFlights = 4;

}  // namespace

MoreauMidpoint::MoreauMidpoint(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
                               ContactObserver* observer, Counters& counters, double shortest)
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
  active_.reserve(n_c);
  strikes_.assign(n_c, false);
  q_m_ = info_.q0;
  if (info_.structure.constant_mass) set_mass();
}

void MoreauMidpoint::set_mass() {
  problem_.mass_matrix(q_m_.data(), M_.data());
  W_.compute(M_, info_.has_bilateral());
  ++counters_.mass_factorizations;
}

bool MoreauMidpoint::step(double h, Rates rates, const MoreauState& from, MoreauState& to) {
  q_m_ = from.q + (0.5 * h) * from.v;  // (1)
  if (!info_.structure.constant_mass) set_mass();
  problem_.force(q_m_.data(), from.v.data(), info_.u.data(), f_.data());
  W_.apply(f_, Wf_);
  ++counters_.force_evaluations;
  ++counters_.linear_solves;
  to.v = from.v + h * Wf_;
  to.depth = from.depth;
  to.flight = from.flight.array() + h;
  bounces_ = false;
  residual_ = 0;
  if (!solve_contacts(h, rates, from, to)) return false;
  to.q = q_m_ + (0.5 * h) * to.v;  // (4)
  return true;
}

/// Contacts that have part in the step. All unilateral ones are open until their laws are solved.
void MoreauMidpoint::find_active(const MoreauState& from, MoreauState& to) {
  active_.clear();
  std::ranges::fill(strikes_, false);
  if (info_.n_c() == 0) return;
  problem_.gap(q_m_.data(), gap_.data());
  for (const int i : info_.unilateral) {
    to.modes[i] = ContactMode::open;
    if (gap_[i] <= touching_[i] + from.depth[i] || from.modes[i] != ContactMode::open) active_.push_back(i);
  }
}

/// (2), (3): replaces the free velocity of `to`, and sets its modes.
bool MoreauMidpoint::solve_contacts(double h, Rates rates, const MoreauState& from, MoreauState& to) {
  find_active(from, to);
  if (info_.n_c() == 0) return true;
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
    if (!rests) shift_[i] += info_.contacts[i].restitution(speed) * speed;
  }
  ContactStatus status = contacts_.set_inverse_mass(W_);
  if (status == ContactStatus::solved) status = contacts_.solve(to.v, shift_, {}, slip_turn_);
  if (status != ContactStatus::solved) {
    reason_ = contacts_.reason(status);
    return false;
  }
  if (settings_.audit) residual_ = contacts_.residual(to.v, shift_, slip_turn_);
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

/// (5)
void MoreauMidpoint::set_turns(double h, const Vector& v) {
  turn_.setZero();
  slip_turn_.setZero();
  if (h == 0) return;
  problem_.gap_acceleration_bias(q_m_.data(), v.data(), turn_.data());
  turn_ *= 0.5 * h;
  if (!info_.has_friction()) return;
  problem_.slip_velocity_derivative(q_m_.data(), v.data(), T_.data());
  slip_turn_.noalias() = (0.5 * h) * T_.lazyProduct(v);
}

/// Mode of a contact that is closed. @param still  bound of velocities that count as zero
ContactMode MoreauMidpoint::mode_of(int contact, double still) const {
  const ContactInfo& info = info_.contacts[contact];
  if (info.n_t == 0) return ContactMode::closed;
  const auto slip = slip_.segment(info.tangent_index, info.n_t);
  if (slip.norm() <= still) return ContactMode::stick;
  if (info.n_t == 2) return ContactMode::slip;
  return slip[0] > 0 ? ContactMode::slip_positive : ContactMode::slip_negative;
}

}  // namespace ricochet
