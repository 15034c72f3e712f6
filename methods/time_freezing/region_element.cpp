#include "methods/time_freezing/region_element.h"

#include <algorithm>

namespace ricochet {
namespace {

// Least ratio of the push to the force of persistent contact: near beta = 1 time would hardly run.
constexpr double kReserve = 10;
constexpr double kMostWeight = 0.5;

}  // namespace

RegionElement::RegionElement(const Problem& problem, const ButcherTableau& tableau, AuxiliaryDynamics& auxiliary,
                             double inner_tolerance, Counters& counters)
    : info_(problem.info()),
      auxiliary_(auxiliary),
      elements_(problem, tableau, counters),
      flight_solver_(elements_, inner_tolerance),
      flight_motion_(tableau),
      slide_solver_(problem, tableau, auxiliary, inner_tolerance, counters),
      q1_(info_.q0),
      v1_(info_.v0),
      y1_(Vector::Zero(info_.n_c())) {
  flight_.resize(info_, tableau.n_s);
  slide_.resize(info_, tableau.n_s);
}

void RegionElement::set_regions(const RegionState& from) {
  y1_ = from.y;
  if (!from.is_free) slide_solver_.set_regions(from.regions);
}

/// s of (3) of pseudo_time_equations.h with beta = s lambda / push: the right side falls with s.
double RegionElement::speed_of_time(const RegionState& from, const RegionForces& forces) const {
  double s = 1, low = 0, high = 1;
  for (int k = 0; k < 40; ++k) {
    s = 0.5 * (low + high);
    double product = 1;
    for (const int i : from.touching) product *= 1 - std::min(1.0, s * forces.lambda_n[i] / auxiliary_.push[i]);
    (product > s ? low : high) = s;
  }
  return s;
}

void RegionElement::guess(const RegionState& from, const RegionForces& forces, double length) {
  Vector beta = Vector::Zero(info_.n_c()), tau = Vector::Zero(info_.n_lambda_t);
  double s = 0, factor = 1;
  if (!from.regions.is_frozen) {
    for (const int i : from.touching) auxiliary_.push[i] = std::max(auxiliary_.push[i], kReserve * forces.lambda_n[i]);
    factor = s = speed_of_time(from, forces);
  }
  for (const int i : from.touching) {
    beta[i] = forces.lambda_n[i] * factor / auxiliary_.push[i];
    for (int d = 0; d < info_.contacts[i].n_t; ++d) {
      const int k = info_.contacts[i].tangent_index + d;
      tau[k] = forces.lambda_t[k] * factor / auxiliary_.push[i];
    }
  }
  slide_.guess(s > 0 ? length / s : length, s, factor * forces.w, beta, tau);
}

bool RegionElement::solve(const RegionState& from, double length) {
  if (from.is_free) {
    flight_.q0 = from.q;
    flight_.v0 = from.v;
    flight_.h = length;
    if (flight_solver_.solve(flight_) != ElementSolver::Result::converged) {
      flight_.forget_guess();
      if (flight_solver_.solve(flight_) != ElementSolver::Result::converged) return false;
    }
    q1_ = flight_.q1;
    v1_ = flight_.v1;
    return true;
  }
  slide_.q0 = from.q;
  slide_.v0 = from.v;
  slide_.y0 = from.y;
  const bool is_solved = from.regions.is_frozen ? slide_solver_.solve_length(slide_, length)
                                                : slide_solver_.solve_to_clock(slide_, length);
  if (!is_solved) return false;
  q1_ = slide_.q1;
  v1_ = slide_.v1;
  y1_ = slide_.y1;
  return true;
}

void RegionElement::stay(const RegionState& from) {
  q1_ = from.q;
  v1_ = from.v;
  y1_ = from.y;
  slide_.Lambda_n.setZero();
  slide_.Lambda_t.setZero();
}

bool RegionElement::is_short_of_push() const {
  return slide_.beta.maxCoeff() > kMostWeight;
}

/// An element in pseudo time has the cubic through q and v at both ends.
void RegionElement::add_motion(const RegionState& from, double t_end, Motion& motion) const {
  if (from.is_free) return flight_motion_.add(from.t, t_end, flight_, motion);
  const double length = t_end - from.t;
  motion.add(from.t, t_end, 3, [&](double s, Vector& q, Vector& v) {
    const Vector change = q1_ - from.q, bend0 = length * from.v - change, bend1 = change - length * v1_;
    q = from.q + s * change + s * (1 - s) * ((1 - s) * bend0 + s * bend1);
    v = (change + (1 - 2 * s) * ((1 - s) * bend0 + s * bend1) + s * (1 - s) * (bend1 - bend0)) / length;
  });
}

}  // namespace ricochet
