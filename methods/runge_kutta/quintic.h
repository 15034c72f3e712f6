#pragma once

#include <algorithm>
#include <cmath>

namespace ricochet {

/// The polynomial of degree 5 on [0, 1] that has given values x, slopes x' and second derivatives x'' at both ends
/// (Hermite):
///
///   p(s) = x_0 + s x_0' + s^2 x_0'' / 2 + s^3 (c_3 + s c_4 + s^2 c_5)                    (1)
///
/// with c_3, c_4, c_5 from the errors of Taylor's polynomial at 0 in x, x' and x'' at 1.
struct QuinticHermite {
  double c[6]{};

  QuinticHermite() = default;
  QuinticHermite(double x0, double slope0, double bend0, double x1, double slope1, double bend1)
      : c{x0, slope0, 0.5 * bend0} {
    const double d0 = x1 - x0 - slope0 - 0.5 * bend0, d1 = slope1 - slope0 - bend0, d2 = bend1 - bend0;
    c[3] = 10 * d0 - 4 * d1 + 0.5 * d2;
    c[4] = -15 * d0 + 7 * d1 - d2;
    c[5] = 6 * d0 - 3 * d1 + 0.5 * d2;
  }

  double value(double s) const { return c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5])))); }
  double slope(double s) const { return c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5]))); }
};

/// Position and velocity at s h from the left end, by (1) of each coordinate.
/// @param h  [s]  @param q0, v0, a0  n_q, at the left end  @param q1, v1, a1  n_q, at the right end
/// @param q, v  out: n_q
inline void interpolate_quintic(double s, double h, const auto& q0, const auto& v0, const auto& a0, const auto& q1,
                                const auto& v1, const auto& a1, auto& q, auto& v) {
  for (decltype(q0.size()) k = 0; k < q0.size(); ++k) {
    const QuinticHermite p(q0[k], h * v0[k], h * h * a0[k], q1[k], h * v1[k], h * h * a1[k]);
    q[k] = p.value(s);
    v[k] = p.slope(s) / h;
  }
}

/// (1) in Bernstein's form, with an estimate of its distance from a function of these values: the remainder
///
///   x^(6) (s (1 - s))^3 / 720                                                            (2)
///
/// is at most 1/64, in the middle, of what a further coefficient would be, and that is taken for no larger than
/// |c_5| + |c_4| / 4.
struct QuinticBernstein {
  double b[6];

  QuinticBernstein(double x0, double slope0, double bend0, double x1, double slope1, double bend1)
      : b{x0, x0 + 0.2 * slope0, x0 + 0.4 * slope0 + 0.05 * bend0, x1 - 0.4 * slope1 + 0.05 * bend1, x1 - 0.2 * slope1,
          x1} {}

  double smallest() const { return std::min({b[0], b[1], b[2], b[3], b[4], b[5]}); }
  double error() const {
    const double c4 = 5 * (b[0] - 4 * b[1] + 6 * b[2] - 4 * b[3] + b[4]);
    const double c5 = (b[5] - b[0]) - 5 * (b[4] - b[1]) + 10 * (b[3] - b[2]);
    return (std::abs(c5) + 0.25 * std::abs(c4)) / 64;
  }
};

}  // namespace ricochet
