#pragma once

#include "problems/problem.h"

namespace ricochet {

/// Linear and angular momentum of the bodies, about the origin of the world.
struct Momentum {
  Vector linear;   ///< 3 [N s]
  Vector angular;  ///< 3 [N m s]
};

/// The sums over the bodies of the geometry of the scene, which has one,
///
///     P = sum m p',   L = sum p x m p' + R I R' omega                                               (1)
///
/// with centres p, rotations R, principal moments I and p' = J_p v, omega = J_omega v (geometry_kinematics.h).
Momentum momentum(const Problem& problem, const Vector& q, const Vector& v);

}  // namespace ricochet
