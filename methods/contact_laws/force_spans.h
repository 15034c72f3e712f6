#pragma once

#include <vector>

#include "problems/interval.h"
#include "problems/problem.h"

namespace ricochet {

/// Longest step for a force that depends on time. An error estimate compares the stages of a step and misses a short
/// pulse of a load between two of them. The force is therefore examined in advance, with constant q and v. Time spans
/// of T/16 are halved until the values f_0 .. f_4 at five equidistant times explain the bounds of f over the span, and
/// f_1, f_3 are near the parabola through the others,
///
///   bounds within [min f_k - r, max f_k + r],   r = max((max f_k - min f_k)/2, 1e-3 max |f_k|, 1e-12 F) (1)
///   |f_1 - (3 f_0 + 6 f_2 - f_4)/8|, |f_3 - (-f_0 + 6 f_2 + 3 f_4)/8| <= r/4                           (1b)
///
/// in every component, or the span is 2^-24 of T/16. F is the upper bound of the force over the whole run, with q and v
/// at the start. A step ends before a span, or is at most twice as long as it:
///
///   h <= max(begin of the span - t, 2 length of the span)   of all spans that begin before t + h     (2)
///
/// Nothing limits scenes whose force does not depend on time or has no bounds.
class ForceSpans {
 public:
  explicit ForceSpans(const Problem& problem);

  /// Whether the force of a scene may depend on time; exact if the force is affine in q and v.
  static bool uses_time(const Problem& problem);

  /// (2) [s], for a step from t that is planned to last h. @param q, v  n_q, at t
  double longest_step(double t, double h, const Vector& q, const Vector& v);

 private:
  struct Span {
    double from, to;
  };
  void hold(const Vector& q, const Vector& v);
  bool is_explained(double from, double to, const Vector& v);

  const Problem& problem_;
  const double T_, start_;  // of the run [s]
  const bool is_limited_;
  std::vector<Span> spans_;  // of which the first passed_ are over
  std::size_t passed_ = 0;
  double known_until_ = 0;           // [s]
  std::vector<Interval> q_, v_, f_;  // n_q, over a span
  Vector negligible_;                // 1e-12 F [N]
  Vector place_, low_, high_;
  Vector value_[5];
};

}  // namespace ricochet
