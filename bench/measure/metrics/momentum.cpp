#include "bench/measure/metrics/momentum.h"

#include "problems/geometry_kinematics.h"

namespace ricochet {

Momentum momentum(const Problem& problem, const Vector& q, const Vector& v) {
  const Geometry& geometry = *problem.info().geometry;
  const std::vector<double> coordinates(q.begin(), q.end());
  Vector3<double> P{}, L{};
  for (std::size_t i = 0; i < geometry.bodies.size(); ++i) {  // (1)
    const Body& body = geometry.bodies[i];
    const BodyMotion<double> motion = motion_of(geometry, static_cast<int>(i), coordinates);
    Vector3<double> velocity{}, omega{};
    for (std::size_t k = 0; k < coordinates.size(); ++k) {
      velocity = sum(velocity, scaled(v[static_cast<Eigen::Index>(k)], motion.J_centre[k]));
      omega = sum(omega, scaled(v[static_cast<Eigen::Index>(k)], motion.J_omega[k]));
    }
    Vector3<double> spin = times_transposed(motion.R, omega);
    for (std::size_t axis = 0; axis < 3; ++axis) spin[axis] *= body.inertia[axis];
    const Vector3<double> p = scaled(body.mass, velocity);
    P = sum(P, p);
    L = sum(L, sum(cross(motion.centre, p), times(motion.R, spin)));
  }
  return {Vector::Map(P.data(), 3), Vector::Map(L.data(), 3)};
}

}  // namespace ricochet
