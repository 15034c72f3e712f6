#pragma once

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
  void measure(const Vector& q, const Vector& v);
  int earliest(int point) const;

  const Problem& problem_;
  int n_ = 0;
  double relative_ = 0;
  Vector psi_, size_, q_, v_;
  Vector left_[kPoints + 1];
};

template <class State>
bool RegionBorder::is_left(double h, const State& state, RegionExit& exit) {
  if (n_ == 0) return false;
  for (int m = 0; m <= kPoints; ++m) {
    state(static_cast<double>(m) / kPoints, q_, v_);
    if (m == 0) measure(q_, v_);
    const int first = outside(q_, v_);
    left_[m] = psi_;
    if (first < 0 || m == 0) continue;
    const int k = earliest(m);
    exit.function = k;
    exit.outside = h * m / kPoints;
    exit.psi_outside = psi_[k];
    for (--m; m > 0 && left_[m][k] <= relative_ * size_[k];) --m;
    exit.inside = h * m / kPoints;
    exit.psi_inside = left_[m][k];
    return true;
  }
  return false;
}

}  // namespace ricochet
