// The algebra of the second-order cone that the interior-point method rests on.
#include "methods/contact_laws/second_order_cone.h"

#include <gtest/gtest.h>

#include <random>

namespace ricochet {
namespace {

using Eigen::Vector3d;

class Cone : public testing::Test {
 protected:
  std::mt19937 generator{1};
  std::uniform_real_distribution<double> uniform{-1, 1};

  Vector3d direction(bool in_plane) {
    return {uniform(generator), uniform(generator), in_plane ? 0 : uniform(generator)};
  }
  /// Inside of L, near its boundary at times.
  Vector3d inside(bool in_plane) {
    Vector3d z = direction(in_plane);
    z[0] = tangent_norm(z) + std::pow(uniform(generator), 4) + 1e-3;
    return z;
  }
};

TEST_F(Cone, StepsEndOnTheBoundary) {
  int finite = 0;
  for (int sample = 0; sample < 200; ++sample) {
    const Vector3d z = inside(sample % 2), dz = direction(sample % 2);
    const double step = step_to_boundary(z, dz);
    if (std::isinf(step)) {  // dz is in L
      EXPECT_GE(dz[0], tangent_norm(dz));
      continue;
    }
    ++finite;
    const Vector3d end = z + step * dz;
    EXPECT_NEAR(end[0], tangent_norm(end), 1e-12 * (1 + step)) << "rounding of numbers of size 1 and of step dz";
    EXPECT_GT(determinant(z + 0.99 * step * dz), 0);
  }
  EXPECT_GT(finite, 100);
}

/// V x = W y with V W = I; and with dx, dy that fulfil (1) of second_order_cone.h, x o y moves to t e in the scaled
/// coordinates, but for the second-order term.
TEST_F(Cone, ScalesBothPointsToOne) {
  for (int sample = 0; sample < 100; ++sample) {
    const bool in_plane = sample % 2;
    ConePair pair;
    pair.x = inside(in_plane);
    pair.y = inside(in_plane);
    pair.dx = direction(in_plane);
    pair.dy = direction(in_plane);
    pair.linearize_scaled();
    // W has the condition of (x, y), up to 1e3 each
    EXPECT_LE((pair.V * pair.W - Eigen::Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_LE((pair.V * pair.x - pair.W * pair.y).norm(), 1e-9);
    if (in_plane) EXPECT_EQ((pair.W * pair.y)[2], 0);
    for (const bool scaled : {true, false}) {
      if (!scaled) pair.linearize_unscaled();
      const double t = 0.3, h = 1e-6;
      pair.aim(t, false);
      const auto product = [&](double s) {
        return Vector3d(arrow(pair.V * (pair.x + s * pair.dx)) * (pair.W * (pair.y + s * pair.dy)));
      };
      const Vector3d slope = (product(h) - product(-h)) / (2 * h), now = product(0);
      // differences of numbers of up to 1e3: 1e-16 * 1e3 / 1e-6
      EXPECT_LE((pair.P * pair.dx + pair.Q * pair.dy - slope).norm(), 1e-6);
      EXPECT_LE((now + pair.target - Vector3d(t, 0, 0)).norm(), 1e-12 * (1 + now.norm()));
      pair.aim(t, true);
      EXPECT_LE((product(1) - (now + slope) - (Vector3d(t, 0, 0) - now - pair.target)).norm(), 1e-6)
          << "the second-order term is what is left";
    }
  }
}

}  // namespace
}  // namespace ricochet
