#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace ricochet {

/// Tangent direction of facet f of a polygon in place of the friction disc: +-1 in the plane, points of the unit circle
/// in space. @param n_t  1 or 2; @param facets  of the polygon, 2 in the plane
inline std::array<double, 2> facet_direction(int n_t, int f, int facets) {
  if (n_t == 1) return {f == 0 ? 1.0 : -1.0, 0.0};
  const double angle = 2 * std::numbers::pi * f / facets;
  return {std::cos(angle), std::sin(angle)};
}

}  // namespace ricochet
