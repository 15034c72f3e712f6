#include "methods/regions/region_border.h"

#include <algorithm>

namespace ricochet {
namespace {

constexpr double kRounding = 1e-12, kOfTolerance = 0.01;  // of (1)

}  // namespace

RegionBorder::RegionBorder(const Problem& problem, const Settings& settings) : problem_(problem) {
  if (!settings.stays_in_region) return;
  n_ = static_cast<int>(problem.info().region.size());
  relative_ = std::max(kRounding, kOfTolerance * settings.tolerance);
  psi_.setZero(n_);
  size_.setZero(n_);
  measure(problem.info().q0, problem.info().v0);
}

void RegionBorder::measure(const Vector& q, const Vector& v) {
  size_ = size_.cwiseMax(problem_.switching_sizes(q, v));
}

/// The function that vanishes first on the chord to a `point` from the one before it, of those outside at `point`.
int RegionBorder::earliest(int point) const {
  int found = -1;
  double least = 2;
  for (int k = 0; k < n_; ++k) {
    const double before = left_[point - 1][k], after = left_[point][k];
    if (after >= -relative_ * size_[k]) continue;
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
