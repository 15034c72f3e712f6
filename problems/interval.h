#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

/// @file
/// Interval arithmetic with outward rounding: a formula evaluated with intervals gives an interval that contains all of
/// its values over the box.
///
/// Boost.Interval is not used: it changes the rounding mode of the processor, which GCC does not model, and has no
/// rounding policy for sin, exp and the like. Here every result is widened, by one unit in the last place if IEEE 754
/// defines the rounding, and by four for functions of the C library, whose documented errors are one or two units.

namespace ricochet {

/// All real numbers from `lower` to `upper`. A bound may be infinite, but is never NaN: an operation that is not
/// defined, such as the root of a negative number, returns the whole real line.
struct Interval {
  double lower;  ///< Least number.
  double upper;  ///< Greatest number.

  Interval() = default;                                 ///< Not initialised, as a double.
  constexpr Interval(double x) : lower(x), upper(x) {}  ///< x alone; NOLINT: implicit, since numbers are intervals
  constexpr Interval(double from, double to) : lower(from), upper(to) {}  ///< from <= to

  /// The whole real line.
  static constexpr Interval whole() {
    return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  /// Whether x lies in the interval.
  bool contains(double x) const { return lower <= x && x <= upper; }
  /// Whether all of x lies in the interval.
  bool contains(const Interval& x) const { return lower <= x.lower && x.upper <= upper; }
  double width() const { return upper - lower; }                                   ///< Width, rounded.
  double middle() const { return 0.5 * lower + 0.5 * upper; }                      ///< Middle, rounded.
  double magnitude() const { return std::max(std::abs(lower), std::abs(upper)); }  ///< The largest |x|.
};

/// @cond  elementary operations and functions, as of doubles

namespace interval_detail {

inline constexpr double kUnit = std::numeric_limits<double>::epsilon();
inline constexpr double kTiny = 1e-300;  // wider than any error of underflow

/// [lower, upper] widened by `units` in the last place.
inline Interval widened(double lower, double upper, double units) {
  if (!(lower <= upper)) return Interval::whole();
  return {lower - units * kUnit * std::abs(lower), upper + units * kUnit * std::abs(upper)};
}
/// widened() for results that may have underflowed.
inline Interval widened_from_zero(double lower, double upper, double units) {
  const Interval x = widened(lower, upper, units);
  return {std::abs(x.lower) < 1e-290 ? x.lower - kTiny : x.lower,
          std::abs(x.upper) < 1e-290 ? x.upper + kTiny : x.upper};
}
/// Image under an increasing function of the C library.
template <class Function>
Interval increasing(const Interval& x, Function f) {
  return widened_from_zero(f(x.lower), f(x.upper), 4);
}

}  // namespace interval_detail

/// The smallest interval that contains both.
inline Interval hull(const Interval& x, const Interval& y) {
  return {std::min(x.lower, y.lower), std::max(x.upper, y.upper)};
}
/// The intersection of overlapping intervals.
inline Interval intersection(const Interval& x, const Interval& y) {
  return {std::max(x.lower, y.lower), std::min(x.upper, y.upper)};
}

inline Interval operator-(const Interval& x) {
  return {-x.upper, -x.lower};
}
inline Interval operator+(const Interval& x, const Interval& y) {
  return interval_detail::widened(x.lower + y.lower, x.upper + y.upper, 1);  // a sum that underflows is exact
}
inline Interval operator-(const Interval& x, const Interval& y) {
  return interval_detail::widened(x.lower - y.upper, x.upper - y.lower, 1);
}
inline Interval operator*(const Interval& x, const Interval& y) {
  if ((x.lower == 0 && x.upper == 0) || (y.lower == 0 && y.upper == 0)) return 0.0;
  const double a = x.lower * y.lower, b = x.lower * y.upper, c = x.upper * y.lower, d = x.upper * y.upper;
  if (std::isnan(a + b + c + d)) {  // 0 times an infinite bound, or bounds of both signs without end
    if (std::isnan(a) || std::isnan(b) || std::isnan(c) || std::isnan(d)) return Interval::whole();
  }
  return interval_detail::widened_from_zero(std::min(std::min(a, b), std::min(c, d)),
                                            std::max(std::max(a, b), std::max(c, d)), 1);
}
inline Interval operator/(const Interval& x, const Interval& y) {
  if (!(y.lower > 0 || y.upper < 0)) return Interval::whole();
  const double a = x.lower / y.lower, b = x.lower / y.upper, c = x.upper / y.lower, d = x.upper / y.upper;
  if (std::isnan(a) || std::isnan(b) || std::isnan(c) || std::isnan(d)) return Interval::whole();
  return interval_detail::widened_from_zero(std::min(std::min(a, b), std::min(c, d)),
                                            std::max(std::max(a, b), std::max(c, d)), 1);
}
inline Interval& operator+=(Interval& x, const Interval& y) {
  return x = x + y;
}

/// x x, which is not negative.
inline Interval square(const Interval& x) {
  const double a = x.lower * x.lower, b = x.upper * x.upper;
  const Interval y = interval_detail::widened_from_zero(x.contains(0) ? 0 : std::min(a, b), std::max(a, b), 1);
  return {std::max(y.lower, 0.0), y.upper};
}
inline Interval abs(const Interval& x) {
  return {x.contains(0) ? 0 : std::min(std::abs(x.lower), std::abs(x.upper)), x.magnitude()};
}
inline Interval sqrt(const Interval& x) {
  if (!(x.upper >= 0)) return Interval::whole();
  const Interval y = interval_detail::widened(std::sqrt(std::max(x.lower, 0.0)), std::sqrt(x.upper), 1);
  return {std::max(y.lower, 0.0), y.upper};
}
inline Interval exp(const Interval& x) {
  const Interval y = interval_detail::increasing(x, [](double t) { return std::exp(t); });
  return {std::max(y.lower, 0.0), y.upper};
}
inline Interval log(const Interval& x) {
  if (!(x.upper > 0)) return Interval::whole();
  const Interval y =
      interval_detail::increasing({std::max(x.lower, 0.0), x.upper}, [](double t) { return std::log(t); });
  return {x.lower > 0 ? y.lower : -std::numeric_limits<double>::infinity(), y.upper};
}
inline Interval sinh(const Interval& x) {
  return interval_detail::increasing(x, [](double t) { return std::sinh(t); });
}
inline Interval cosh(const Interval& x) {
  const Interval size = abs(x), y = interval_detail::increasing(size, [](double t) { return std::cosh(t); });
  return {std::max(y.lower, 1.0), y.upper};
}
inline Interval tanh(const Interval& x) {
  return intersection(interval_detail::increasing(x, [](double t) { return std::tanh(t); }), {-1, 1});
}
inline Interval atan(const Interval& x) {
  return interval_detail::increasing(x, [](double t) { return std::atan(t); });
}
inline Interval asin(const Interval& x) {
  if (!(x.upper >= -1 && x.lower <= 1)) return Interval::whole();
  return interval_detail::increasing({std::max(x.lower, -1.0), std::min(x.upper, 1.0)},
                                     [](double t) { return std::asin(t); });
}
inline Interval acos(const Interval& x) {
  if (!(x.upper >= -1 && x.lower <= 1)) return Interval::whole();
  const double from = std::acos(std::min(x.upper, 1.0)), to = std::acos(std::max(x.lower, -1.0));
  const Interval y = interval_detail::widened_from_zero(from, to, 4);
  return {std::max(y.lower, 0.0), y.upper};
}

namespace interval_detail {

inline constexpr double kPi = 3.14159265358979323846;

/// Whether `x` may contain phase + k period for an integer k; true if rounding leaves this undecided.
inline bool may_contain_multiple(const Interval& x, double phase, double period) {
  const double slack = 8 * kUnit * (x.magnitude() + period);
  const double first = phase + period * std::ceil((x.lower - slack - phase) / period);
  return first <= x.upper + slack;
}

}  // namespace interval_detail

inline Interval cos(const Interval& x) {
  using namespace interval_detail;
  if (!(x.width() < 2 * kPi) || !(x.magnitude() < 1e15)) return {-1, 1};
  const double a = std::cos(x.lower), b = std::cos(x.upper);
  const Interval ends = widened_from_zero(std::min(a, b), std::max(a, b), 4);
  return {may_contain_multiple(x, kPi, 2 * kPi) ? -1 : std::max(ends.lower, -1.0),
          may_contain_multiple(x, 0, 2 * kPi) ? 1 : std::min(ends.upper, 1.0)};
}
inline Interval sin(const Interval& x) {
  using namespace interval_detail;
  if (!(x.width() < 2 * kPi) || !(x.magnitude() < 1e15)) return {-1, 1};
  const double a = std::sin(x.lower), b = std::sin(x.upper);
  const Interval ends = widened_from_zero(std::min(a, b), std::max(a, b), 4);
  return {may_contain_multiple(x, -0.5 * kPi, 2 * kPi) ? -1 : std::max(ends.lower, -1.0),
          may_contain_multiple(x, 0.5 * kPi, 2 * kPi) ? 1 : std::min(ends.upper, 1.0)};
}
inline Interval tan(const Interval& x) {
  using namespace interval_detail;
  if (!(x.width() < kPi) || !(x.magnitude() < 1e15) || may_contain_multiple(x, 0.5 * kPi, kPi))
    return Interval::whole();
  return increasing(x, [](double t) { return std::tan(t); });
}
/// The angle of (x, y); all angles if the box touches the negative x-axis, where the angle jumps.
inline Interval atan2(const Interval& y, const Interval& x) {
  using namespace interval_detail;
  if (y.contains(0) && !(x.lower > 0)) return widened(-kPi, kPi, 4);
  const double corner[] = {std::atan2(y.lower, x.lower), std::atan2(y.lower, x.upper), std::atan2(y.upper, x.lower),
                           std::atan2(y.upper, x.upper)};
  return widened_from_zero(std::min({corner[0], corner[1], corner[2], corner[3]}),
                           std::max({corner[0], corner[1], corner[2], corner[3]}), 4);
}
inline Interval pow(const Interval& x, const Interval& y) {
  if (!(x.lower > 0)) return Interval::whole();
  return exp(y * log(x));
}
inline Interval sign(const Interval& x) {
  return {x.lower > 0 ? 1.0 : x.lower == 0 ? 0.0 : -1.0, x.upper < 0 ? -1.0 : x.upper == 0 ? 0.0 : 1.0};
}
/// `a` if c > 0, else `b`; their union if the sign of c is undecided.
inline Interval choose(const Interval& c, const Interval& a, const Interval& b) {
  return c.lower > 0 ? a : c.upper <= 0 ? b : hull(a, b);
}

/// @endcond

}  // namespace ricochet
