#pragma once

#include <vector>

#include "methods/method.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Watches whether the steps of a run stay in their region: with the signs sigma_k of ProblemInfo::region,
///
///     sigma_k psi_k(q, v) >= -delta_k,   delta_k = max(1e-12, tolerance / 100) sum_j |d psi_k / dx_j| (1 + |x_j|)  (1)
///
/// at 16 points of each step, x = (q, v). The threshold keeps bodies at rest, for which psi_k is a rounded zero, where
/// they are. The border itself is located by RegionRun.
///
/// A motion that has slid on psi_k = 0 leaves it with the rate zero: psi_k = O(t^2), which is less than the error of a
/// path between stages. As long as steps begin at psi_k = 0 and the first one did so with the rate zero, (1) is required
/// of psi_k at their right ends only.
class RegionBorder {
 public:
  /// Watches nothing unless `settings` ask for it.
  RegionBorder(const Problem& problem, const Settings& settings);

  bool is_watched() const { return n_ > 0; }
  /// The function that violates (1) at a state, the first one; -1 if none does.
  int outside(const Vector& q, const Vector& v);
  /// The function that violates (1) after a jump of the velocity, and not before it, the first one; -1 if none does.
  int left_by_jump(const Vector& q, const Vector& v_before, const Vector& v_after);

  /// Searches a step of length `h` [s]. @param state  state(s, q, v) sets the state for s in [0, 1]
  /// @returns whether it leaves the region; then `exit` has the interval, from the begin of the step
  template <class State>
  bool is_left(double h, const State& state, RegionExit& exit);

 private:
  static constexpr int kPoints = 16;
  static constexpr double kResolved = 1e-14;  // of the time: shorter steps are seen at their ends
  void measure(const Vector& q, const Vector& v);
  void find_tangential_start();
  bool is_outside(int k, double psi, int point) const;
  int earliest(int last, int point) const;

  const Problem& problem_;
  int n_ = 0;
  double relative_ = 0;
  std::vector<char> is_leaving_;  // n_s: the run began at psi_k = 0 with the rate zero, and is still there
  Vector psi_, size_, q_, v_;
  Vector left_[kPoints + 1];
};

template <class State>
bool RegionBorder::is_left(double h, const State& state, RegionExit& exit) {
  if (n_ == 0) return false;
  const bool has_points = h > kResolved * (problem_.info().start_time() + problem_.info().end_time);  // else they round
  const int stride = has_points ? 1 : kPoints;
  for (int m = 0; m <= kPoints; m += stride) {
    state(static_cast<double>(m) / kPoints, q_, v_);
    if (m == 0) measure(q_, v_);
    outside(q_, v_);
    left_[m] = psi_;
    if (m == 0) {
      for (int k = 0; k < n_; ++k) is_leaving_[k] = is_leaving_[k] && psi_[k] <= relative_ * size_[k];
      continue;
    }
    const int k = earliest(m - stride, m);
    if (k < 0) continue;
    exit.function = k;
    exit.outside = h * m / kPoints;
    exit.psi_outside = psi_[k];
    for (m -= stride; m > 0 && left_[m][k] <= relative_ * size_[k];) m -= stride;
    exit.inside = h * m / kPoints;
    exit.psi_inside = left_[m][k];
    return true;
  }
  return false;
}

}  // namespace ricochet
