#include "methods/time_stepping/common/position_projection.h"

#include <algorithm>
#include <cmath>

#include "methods/time_stepping/common/gap_rounding.h"

namespace ricochet {
namespace {

constexpr int kMaxProjections = 20;

}  // namespace

PositionProjection::PositionProjection(const Problem& problem, double h, Counters& counters)
    : problem_(problem),
      counters_(counters),
      contacts_(problem, {}, {.normal_only = true}, counters),
      is_active_(problem.n_c()),
      M_(problem.n_q(), problem.n_q()),
      gap_(Vector::Zero(problem.n_c())),
      rounding_(gap_rounding(problem, h)),
      dq_(problem.n_q()) {
  active_.reserve(problem.n_c());
}

bool PositionProjection::apply(Vector& q) {
  const ProblemInfo& info = problem_.info();
  std::fill(is_active_.begin(), is_active_.end(), false);
  for (int step = 0; step < kMaxProjections; ++step) {
    problem_.gap(q.data(), gap_.data());
    bool is_exact = true;
    active_.clear();
    for (const int i : info.unilateral) {
      is_exact = is_exact && gap_[i] >= -rounding_[i];
      is_active_[i] = is_active_[i] || gap_[i] < -rounding_[i];
      if (is_active_[i]) active_.push_back(i);
    }
    for (const int i : info.bilateral) is_exact = is_exact && std::abs(gap_[i]) <= rounding_[i];
    if (is_exact) return true;
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
      reason_ = contacts_.reason(status);
      return false;
    }
    q += dq_;
  }
  reason_ = "the projection onto the gaps did not converge";
  return false;
}

}  // namespace ricochet
