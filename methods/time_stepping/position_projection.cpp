#include "methods/time_stepping/position_projection.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr int kMostSteps = 20;
// What remains of a gap, relative to 1 m and to the coordinates: a few hundred roundings.
constexpr double kExact = 1e-13;

}  // namespace

PositionProjection::PositionProjection(const Problem& problem, Counters& counters)
    : problem_(problem),
      counters_(counters),
      contacts_(problem, {}, {.normal_only = true}, counters),
      is_active_(problem.n_c()),
      M_(problem.n_q(), problem.n_q()),
      gap_(Vector::Zero(problem.n_c())),
      dq_(problem.n_q()) {
  active_.reserve(problem.n_c());
}

bool PositionProjection::apply(Vector& q) {
  const ProblemInfo& info = problem_.info();
  std::fill(is_active_.begin(), is_active_.end(), false);
  for (int step = 0; step < kMostSteps; ++step) {
    problem_.gap(q.data(), gap_.data());
    const double exact = kExact * (1 + q.cwiseAbs().maxCoeff());
    double worst = 0;
    active_.clear();
    for (const int i : info.unilateral) {
      worst = std::max(worst, -gap_[i]);
      is_active_[i] = is_active_[i] || gap_[i] < -exact;
      if (is_active_[i]) active_.push_back(i);
    }
    for (const int i : info.bilateral) worst = std::max(worst, std::abs(gap_[i]));
    if (worst <= exact) return true;
    if (step == 0 || !info.structure.constant_mass) {
      problem_.mass_matrix(q.data(), M_.data());
      W_.compute(M_, info.has_bilateral());
      ++counters_.mass_factorizations;
    }
    contacts_.set_position(q);
    contacts_.set_active(active_);
    dq_.setZero();
    ContactStatus status = contacts_.set_inverse_mass(W_);
    if (status == ContactStatus::solved) status = contacts_.solve(dq_, gap_, none_);  // (1)
    if (status != ContactStatus::solved) {
      reason_ = reason_of(status);
      return false;
    }
    q += dq_;
  }
  reason_ = "the projection onto the gaps did not converge";
  return false;
}

}  // namespace ricochet
