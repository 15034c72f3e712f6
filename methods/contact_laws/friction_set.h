#pragma once

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/contact_problem.h"

namespace ricochet {

/// Length of a tangential vector with n_t = 0, 1 or 2 entries.
inline double tangential_length(const double* x, int n_t) {
  return n_t == 0 ? 0 : n_t == 1 ? std::abs(x[0]) : std::hypot(x[0], x[1]);
}

/// y <- the nearest point of the set of impulses that one contact can have,
///
///   C = {y_n >= 0, ||y_t|| <= mu (y_n + p)},                                                         (1)
///
/// the friction cone for p = 0, else the part with y_n >= 0 of a cone whose tip is at y_n = -p. Where the nearest
/// point of that cone has y_n < 0, that of C lies in the plane y_n = 0, since both are convex.
/// @param y  1 + n_t, in and out
inline void project_on_friction_set(double mu, int n_t, double p, double* y) {
  const double size = tangential_length(y + 1, n_t), normal = y[0] + p;
  double radius = mu * normal;
  if (size > radius) {
    const double nearest = std::max(0.0, (normal + mu * size) / (1 + mu * mu));
    y[0] = nearest - p;
    radius = mu * nearest;
  }
  if (y[0] < 0) {
    y[0] = 0;
    radius = mu * p;
  }
  if (size > radius) {
    for (int d = 1; d <= n_t; ++d) y[d] *= radius / size;
  }
}

}  // namespace ricochet
