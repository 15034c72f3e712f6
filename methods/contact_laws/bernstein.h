#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "problems/problem.h"

/// @file
/// Polynomials on [0, 1] in Bernstein's form, p(s) = sum_k b_k B_k(s), k = 0 .. degree: their coefficients bound them.

namespace ricochet::bernstein {

inline constexpr int kMaxDegree = 23;

/// B_k(s), k = 0 .. degree.
inline Vector basis(double s, int degree) {
  Vector B(degree + 1);
  double binomial = 1;
  for (int k = 0; k <= degree; ++k) {
    B[k] = binomial * std::pow(s, k) * std::pow(1 - s, degree - k);
    binomial = binomial * (degree - k) / (k + 1);
  }
  return B;
}

/// [min_k b_k, max_k b_k] contains p(s), with room for the rounding of the coefficients.
inline Interval range(const double* b, int degree, std::ptrdiff_t stride = 1) {
  double lower = b[0], upper = b[0];
  for (int k = 1; k <= degree; ++k) {
    lower = std::min(lower, b[k * stride]);
    upper = std::max(upper, b[k * stride]);
  }
  return {lower - 4 * std::numeric_limits<double>::epsilon() * std::abs(lower),
          upper + 4 * std::numeric_limits<double>::epsilon() * std::abs(upper)};
}

/// Extends the interval of each row of `path`, coefficients of one polynomial, by its range().
inline void extend(const Matrix& path, int degree, std::vector<Interval>& ranges) {
  for (Eigen::Index k = 0; k < path.rows(); ++k) {
    Interval& row = ranges[static_cast<std::size_t>(k)];
    row = hull(row, range(path.data() + k, degree, path.rows()));
  }
}

/// Bounds of p'(s), whose coefficients are degree (b_k+1 - b_k).
inline Interval slope_range(const double* b, int degree) {
  double lower = b[1] - b[0], upper = lower, size = std::abs(b[0]);
  for (int k = 1; k <= degree; ++k) {
    lower = std::min(lower, b[k] - b[k - 1]);
    upper = std::max(upper, b[k] - b[k - 1]);
    size = std::max(size, std::abs(b[k]));
  }
  const double rounding = 2 * std::numeric_limits<double>::epsilon() * size;
  return {degree * (lower - rounding), degree * (upper + rounding)};
}

/// p(s), by de Casteljau's algorithm.
inline double value(const double* b, std::ptrdiff_t stride, int degree, double s) {
  double t[kMaxDegree + 1];
  for (int k = 0; k <= degree; ++k) t[k] = b[k * stride];
  for (int level = degree; level > 0; --level) {
    for (int k = 0; k < level; ++k) t[k] += s * (t[k + 1] - t[k]);
  }
  return t[0];
}

/// The same algorithm, for `rows` polynomials one after the other: `left` becomes the left half of b, and b its right
/// half.
inline void halve(int rows, int degree, double* b, double* left) {
  for (int row = 0; row < rows; ++row, b += degree + 1, left += degree + 1) {
    left[0] = b[0];
    for (int level = 1; level <= degree; ++level) {
      for (int k = 0; k <= degree - level; ++k) b[k] = 0.5 * (b[k] + b[k + 1]);
      left[level] = b[0];
    }
  }
}

/// b becomes the part of it up to s = `until`.
inline void keep_left(int rows, int degree, double until, double* b) {
  for (int row = 0; row < rows; ++row, b += degree + 1) {
    for (int level = 1; level <= degree; ++level) {
      for (int k = degree; k >= level; --k) b[k] = b[k - 1] + until * (b[k] - b[k - 1]);
    }
  }
}

/// The same polynomial with one more coefficient, b[(degree + 1) stride].
inline void raise(double* b, std::ptrdiff_t stride, int degree) {
  b[(degree + 1) * stride] = b[degree * stride];
  const double part = 1.0 / (degree + 1);
  for (int k = degree; k > 0; --k) b[k * stride] += k * part * (b[(k - 1) * stride] - b[k * stride]);
}

}  // namespace ricochet::bernstein
