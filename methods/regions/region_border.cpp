#include "methods/regions/region_border.h"

#include <algorithm>

namespace ricochet {
namespace {

constexpr double kRounding = 1e-12, kOfTolerance = 0.01;  // of (1)
constexpr double kTangential = 1e-6;                      // of the terms of a rate: zero, where s_k = +-1 was located

}  // namespace

RegionBorder::RegionBorder(const Problem& problem, const Settings& settings) : problem_(problem) {
  if (!settings.stays_in_region) return;
  n_ = static_cast<int>(problem.info().region.size());
  relative_ = std::max(kRounding, kOfTolerance * settings.tolerance);
  psi_.setZero(n_);
  size_.setZero(n_);
  is_leaving_.assign(static_cast<std::size_t>(n_), 0);
  measure(problem.info().q0, problem.info().v0);
  find_tangential_start();
}

void RegionBorder::find_tangential_start() {
  const Vector &q = problem_.info().q0, &v = problem_.info().v0;
  outside(q, v);
  if ((psi_.cwiseAbs().array() > relative_ * size_.array()).all()) return;
  Matrix D(n_, 2 * q.size() + std::ssize(problem_.info().parameters));
  problem_.switching_derivative(q.data(), v.data(), D.data());
  Vector x_rate(2 * q.size());
  x_rate << v, problem_.free_acceleration(q, v);
  for (int k = 0; k < n_; ++k) {
    const auto slope = D.row(k).head(x_rate.size());
    const double terms = slope.cwiseAbs().dot(x_rate.cwiseAbs());
    is_leaving_[k] = std::abs(psi_[k]) <= relative_ * size_[k] && std::abs(slope.dot(x_rate)) <= kTangential * terms;
  }
}

void RegionBorder::measure(const Vector& q, const Vector& v) {
  size_ = size_.cwiseMax(problem_.switching_sizes(q, v));
}

bool RegionBorder::is_outside(int k, double psi, int point) const {
  return psi < -relative_ * size_[k] && (point == kPoints || is_leaving_[k] == 0);
}

/// The function that vanishes first on the chord from the point `last` to a `point`, of those outside at `point`.
int RegionBorder::earliest(int last, int point) const {
  int found = -1;
  double least = 2;
  for (int k = 0; k < n_; ++k) {
    const double before = left_[last][k], after = left_[point][k];
    if (!is_outside(k, after, point)) continue;
    const double part = before > 0 ? before / (before - after) : 0;
    if (part >= least) continue;
    least = part;
    found = k;
  }
  return found;
}

int RegionBorder::outside(const Vector& q, const Vector& v) {
  problem_.switching(q.data(), v.data(), psi_.data());
  int found = -1;
  for (int k = 0; k < n_; ++k) {
    psi_[k] *= problem_.info().region[k];
    if (found < 0 && psi_[k] < -relative_ * size_[k]) found = k;
  }
  return found;
}

int RegionBorder::left_by_jump(const Vector& q, const Vector& v_before, const Vector& v_after) {
  if (outside(q, v_after) < 0) return -1;
  const Vector after = psi_;
  outside(q, v_before);
  for (int k = 0; k < n_; ++k) {
    if (after[k] < -relative_ * size_[k] && psi_[k] >= -relative_ * size_[k]) return k;
  }
  return -1;
}

}  // namespace ricochet
