#pragma once

#include <vector>

#include "methods/elements/element.h"
#include "problems/problem.h"

namespace ricochet {

/// Forces of redundant contacts are not unique: with the columns D of their directions at one point,
///
///   D x = D x_0,   x = x_0 + N y,   N: an orthonormal basis of the null space of D,     (1)
///
/// moves the bodies as x_0 does. The solvers of elements take the smallest forces, which may lie outside the friction
/// cones although others lie inside: of a pendulum that leans on a rough wall, one force along its path is enough, and
/// any direction of it will do. The laws ask for some x inside,
///
///   x_n >= 0,   ||x_t|| <= mu x_n   at sticking contacts,   x_t = r x_n   at slipping ones.     (2)
///
/// One is found by projections onto (1) and the cones of (2) in turn, each step 1.8 times as long as the way to the
/// cones: where there are points inside, it ends after finitely many.
///
/// Forces of the cones that balance each other without a load,
///
///   D x = 0,   x of (2),   sum_i x_n^i = 1,     (3)
///
/// wedge the bodies: with enough of them anything sticks, and the laws leave the motion open. Then the smallest forces
/// decide, and nothing is divided. Without friction they change no motion: a row of discs that a box just holds.
class ForceDivision {
 public:
  explicit ForceDivision(const Problem& problem) : problem_(problem) {}

  /// Divides the forces at every stage and at the right end of an element so that (2) holds, up to rounding of the
  /// forces. Returns false and changes nothing if that is impossible, if (3) has a solution, or if friction in space
  /// has a polygon.
  bool into_cones(Element& element) const;

 private:
  struct Cone {
    int contact = -1;
    Eigen::Index normal = 0;  ///< place of x_n; the tangential forces of a contact that sticks follow
    int n_t = 0;              ///< 0: without friction, or slipping
    Vector friction;          ///< r of (2), of a slipping contact
  };
  /// The forces of closed contacts at one point. @param slide  whether those that slip have no tangential unknown
  struct Forces {
    std::vector<Cone> cones;
    Vector x;
    Matrix N;
  };
  Forces forces(const Vector& q, const std::vector<ContactMode>& modes, const Vector& lambda_n, const Vector& lambda_t,
                bool slide) const;
  bool reach_cones(const std::vector<Cone>& cones, const Matrix& N, Vector& x) const;
  bool can_wedge(const Forces& all) const;
  bool divide(const Vector& q, const std::vector<ContactMode>& modes, Eigen::Ref<Vector> lambda_n,
              Eigen::Ref<Vector> lambda_t) const;

  const Problem& problem_;
};

}  // namespace ricochet
