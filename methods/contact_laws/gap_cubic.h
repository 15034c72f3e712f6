#pragma once

#include <gsl/gsl_poly.h>

namespace ricochet {

/// The gap of a contact between two points of a motion: the cubic p that has its values and its rates there, s in
/// units of the interval.
struct GapCubic {
  double c0, c1, c2, c3;

  /// @param left, right            gaps [m]
  /// @param left_rate, right_rate  per unit of s [m]
  GapCubic(double left, double left_rate, double right, double right_rate)
      : c0(left),
        c1(left_rate),
        c2(3 * (right - left) - 2 * left_rate - right_rate),
        c3(2 * (left - right) + left_rate + right_rate) {}

  double operator()(double s) const { return c0 + s * (c1 + s * (c2 + s * c3)); }

  /// Where it has its minimum in (0, 1), when it falls at 0 and rises at 1.
  double minimum() const {
    double s[2]{0.5, 0.5};
    const int n = gsl_poly_solve_quadratic(3 * c3, 2 * c2, c1, &s[0], &s[1]);
    return n == 2 && !(s[0] > 0 && s[0] < 1) ? s[1] : s[0];
  }

  /// Its first root before a negative minimum.
  double first_root(double minimum) const {
    if (c3 == 0) {
      double s[2]{0, 0};
      gsl_poly_solve_quadratic(c2, c1, c0, &s[0], &s[1]);
      return s[0];
    }
    double s[3]{0, 0, 0};
    const int n = gsl_poly_solve_cubic(c2 / c3, c1 / c3, c0 / c3, &s[0], &s[1], &s[2]);
    for (int k = 0; k < n; ++k) {
      if (s[k] > 0 && s[k] < minimum) return s[k];
    }
    return 0.5 * minimum;  // only a guess is asked for
  }
};

}  // namespace ricochet
