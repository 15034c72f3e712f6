#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "problems/derivatives/real_functions.h"
#include "problems/geometry.h"
#include "problems/tangent_frame.h"

/// @file
/// The kinematics of a geometry: poses, gaps, tangents and M, as numbers and as formulas.
///
/// A body's pose is the rotation R from its axes into those of the world, and the centre of mass p. With the columns
/// of two 3 x n_q matrices, p' = J_p v and omega = J_omega v in world axes; a point at r in the body's axes has
///
///     x = p + R r,   x' = (J_p - [R r]x J_omega) v                                                           (1)
///     M = sum over bodies of m J_p' J_p + (R' J_omega)' diag(inertia) (R' J_omega)                           (2)
///
/// A contact is that of a ball with centre c_2 and radius r_2, which belongs to the second shape of the pair, with the
/// first shape:
///
///     half-space  n its outer normal, c_1 on its plane:        f_c = n' (c_2 - c_1) - r_2                    (3)
///     box         its upper face, as the half-space above it
///     polygon     its faces i with normals n_i through a_i, in the plane, of which one holds:
///                 x_i = n_i' (c_2 - a_i),   f_c = max x_i - r_2 if it is convex, min x_i - r_2 if concave    (3a)
///     sphere      n = (c_2 - c_1) / |c_2 - c_1|:               f_c = |c_2 - c_1| - r_1 - r_2                 (4)
///
/// A ball (r_2 > 0) beyond the ends of both faces at a convex corner a has the distance |c_2 - a| - r_2 from it instead.
/// Faces change where the formulas bend (problems/regions/switching_functions.h).
///
/// The ball is a sphere, the end of a capsule, or the corner of a box or a polygon (r_2 = 0). A box or a capsule without a chosen
/// corner touches a plane with its deepest point: its support along -n is added to the radius,
///
///     sum_k h_k |n' e_k|,   e_k the shape's axes, h_k half its extent along them,                            (5)
///
/// which is smooth unless the shape turns relative to the plane. The gap is signed, and smooth except (4) at distance
/// zero. The slip velocity is that of the second body's point x_2 relative to the adjacent point x_1 of the first body,
/// along the tangents t_k of n. In the plane there is one tangent, a quarter turn behind n; in space there are the
/// first two axes of the first shape, or for (4) those of tangents_of().
///
///     x_2 = c_2 - r_2 n,   x_1 = x_2 - f_c n
///     J_n = (d(x_2' - x_1')/dv)' n,   J_t = (d(x_2' - x_1')/dv)' t_k                                         (6)
///
/// J_n is the gradient of f_c.

namespace ricochet {

/// Position and orientation of a body or a shape.
template <class T>
struct PoseOf {
  Vector3<T> centre{};           ///< p [m]
  Matrix3<T> R = identity<T>();  ///< rows; from its axes to those of the world

  /// Position of the point with coordinates `r` in its axes [m].
  Vector3<T> point(const Vector3<T>& r) const { return sum(centre, times(R, r)); }
  /// Pose of an object with the pose `other` in its axes.
  PoseOf carries(const PoseOf& other) const { return {point(other.centre), times(R, other.R)}; }
};
using Pose = PoseOf<double>;  ///< In numbers.

/// Pose of a body and its derivatives with respect to the coordinates.
template <class T>
struct BodyMotion : PoseOf<T> {
  std::vector<Vector3<T>> J_centre;  ///< columns of J_p, n_q
  std::vector<Vector3<T>> J_omega;   ///< columns of J_omega, n_q

  /// (1): column k of d(x')/dv for the body's point at `x` in the world [m].
  Vector3<T> velocity_column(std::size_t k, const Vector3<T>& x) const {
    return sum(J_centre[k], cross(J_omega[k], difference(x, this->centre)));
  }
};

/// Gap, normal, point and tangents of two shapes.
template <class T>
struct Touch {
  T gap{0};                              ///< f_c [m]
  Vector3<T> normal{};                   ///< n, from the first to the second shape
  Vector3<T> point{};                    ///< x_2, on the second shape [m]
  std::array<Vector3<T>, 2> tangents{};  ///< t_k; in the plane only the first
};

/// A contact of two shapes.
template <class T>
struct ShapeContact : Touch<T> {
  std::vector<T> J_n;               ///< n_q
  std::vector<std::vector<T>> J_t;  ///< one direction in the plane, two in space, n_q each
};

namespace geometry_detail {

template <class T>
Matrix3<T> about(int axis, const T& angle) {
  using std::sin, std::cos;
  const T s = sin(angle), c = cos(angle);
  const std::size_t i = (axis + 1) % 3, j = (axis + 2) % 3;
  Matrix3<T> R = identity<T>();
  R[i][i] = R[j][j] = c;
  R[i][j] = -s;
  R[j][i] = s;
  return R;
}

template <class T>
Matrix3<T> cardan(const std::array<T, 3>& angles) {
  return times(about(0, angles[0]), times(about(1, angles[1]), about(2, angles[2])));
}

template <class T>
T value(const PoseEntryOf<T>& entry, const std::vector<T>& q) {
  return entry.coordinate < 0 ? entry.offset : T(q[static_cast<std::size_t>(entry.coordinate)] + entry.offset);
}

/// The ball of a shape, see above: its centre in the axes of the shape, and half edges if (5) is its radius.
template <class T>
struct Ball {
  Vector3<T> centre{};
  T radius{0};
  Vector3<T> support{};
};

template <class T>
Ball<T> ball_of(const BodyShapeOf<T>& shape, int corner) {
  const auto side = [corner](int k, const T& size) { return (corner >> k & 1) != 0 ? size : T(-size); };
  switch (shape.kind) {
    case ShapeKind::sphere:
      return {{}, shape.size[0], {}};
    case ShapeKind::capsule:
      if (corner < 0) return {{}, shape.size[0], {shape.size[1], T(0), T(0)}};
      return {{side(0, shape.size[1]), T(0), T(0)}, shape.size[0], {}};
    case ShapeKind::box:
      if (corner < 0) return {{}, T(0), shape.size};
      return {{side(0, shape.size[0]), side(1, shape.size[1]), side(2, shape.size[2])}, T(0), {}};
    case ShapeKind::polygon:
      return {shape.corners[static_cast<std::size_t>(std::max(0, corner))], T(0), {}};
    case ShapeKind::half_space:
      break;
  }
  return {};
}

/// Distance and outer normal of the surface of a shape, in its axes.
template <class T>
struct Nearest {
  T distance{0};
  Vector3<T> normal{};
};

/// `a` if c > 0, else `b`.
template <class T>
Nearest<T> chosen(const T& c, const Nearest<T>& a, const Nearest<T>& b) {
  Nearest<T> result{choose(c, a.distance, b.distance), {}};
  for (std::size_t k = 0; k < 2; ++k) result.normal[k] = choose(c, a.normal[k], b.normal[k]);
  return result;
}

/// (3a) for a centre at `p` in the axes of the `polygon`. @param is_ball  of a radius that is not zero
template <class T>
Nearest<T> nearest_of(const BodyShapeOf<T>& polygon, const Vector3<T>& p, bool is_ball) {
  using std::sqrt;
  const auto& a = polygon.corners;
  const std::size_t n = a.size(), n_faces = polygon.is_open ? n - 1 : n;
  std::vector<Vector3<T>> along;  // unit vectors of the faces
  for (std::size_t i = 0; i < n_faces; ++i) {
    const Vector3<T> face = difference(a[(i + 1) % n], a[i]);
    along.push_back(scaled(T(1) / sqrt(dot(face, face)), face));
  }
  Nearest<T> nearest;
  for (std::size_t i = 0; i < n_faces; ++i) {
    const Vector3<T> normal{along[i][1], T(-along[i][0]), T(0)};
    const Nearest<T> face{dot(normal, difference(p, a[i])), normal};
    if (i == 0)
      nearest = face;
    else
      nearest = chosen(T(polygon.is_concave ? nearest.distance - face.distance : face.distance - nearest.distance),
                       face, nearest);
  }
  if (!is_ball || polygon.is_concave) return nearest;
  for (std::size_t k = polygon.is_open ? 1 : 0; k < (polygon.is_open ? n - 1 : n); ++k) {
    const Vector3<T> d = difference(p, a[k]);
    const T length = sqrt(dot(d, d)), beyond = dot(along[(k + n_faces - 1) % n_faces], d), before = -dot(along[k], d);
    nearest = chosen(T(choose(beyond, before, T(-1))), {length, scaled(T(1) / length, d)}, nearest);
  }
  return nearest;
}

inline bool is_zero(double x) {
  return x == 0;
}
inline bool is_zero(const GiNaC::ex& x) {
  return x.is_zero();
}

}  // namespace geometry_detail

/// The motion of a `body` of the geometry, -1 for the world, at `q`, which has at least n_q entries.
template <class T>
BodyMotion<T> motion_of(const GeometryOf<T>& geometry, int body, const std::vector<T>& q) {
  using namespace geometry_detail;
  BodyMotion<T> motion;
  motion.J_centre.assign(q.size(), {});
  motion.J_omega.assign(q.size(), {});
  if (body < 0) return motion;
  const BodyOf<T>& b = geometry.bodies[static_cast<std::size_t>(body)];

  // The point `position`.
  BodyMotion<T> frame = motion_of(geometry, b.parent, q);
  const Vector3<T> r{value(b.position[0], q), value(b.position[1], q), value(b.position[2], q)};
  motion.centre = frame.point(r);
  if (b.parent >= 0) {
    for (std::size_t k = 0; k < q.size(); ++k) motion.J_centre[k] = frame.velocity_column(k, motion.centre);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int k = b.position[axis].coordinate;
    if (k < 0) continue;
    Vector3<T>& column = motion.J_centre[static_cast<std::size_t>(k)];
    column = sum(column, column_of(frame.R, axis));
  }

  // The rotation.
  const auto turns_about = [&](const PoseEntryOf<T>& angle, const Vector3<T>& axis) {
    if (angle.coordinate < 0) return;
    Vector3<T>& column = motion.J_omega[static_cast<std::size_t>(angle.coordinate)];
    column = sum(column, axis);
  };
  const Matrix3<T> I = identity<T>();
  switch (b.rotation) {
    case BodyRotation::none:
      break;
    case BodyRotation::planar:
      motion.R = about(2, value(b.angles[0], q));
      turns_about(b.angles[0], I[2]);
      break;
    case BodyRotation::cardan: {
      const Matrix3<T> first = about(0, value(b.angles[0], q)), two = times(first, about(1, value(b.angles[1], q)));
      motion.R = times(two, about(2, value(b.angles[2], q)));
      turns_about(b.angles[0], I[0]);
      turns_about(b.angles[1], column_of(first, 1));
      turns_about(b.angles[2], column_of(two, 2));
      break;
    }
    case BodyRotation::spin:
      for (std::size_t axis = 0; axis < 3; ++axis) turns_about(b.angles[axis], I[axis]);
      break;
  }

  // From the pivot to the centre of mass.
  const Vector3<T> arm = times(motion.R, b.centre_from_pivot);
  motion.centre = sum(motion.centre, arm);
  for (std::size_t k = 0; k < q.size(); ++k)
    motion.J_centre[k] = sum(motion.J_centre[k], cross(motion.J_omega[k], arm));
  return motion;
}

/// Adds the coordinates that move a `body` of the geometry to a list.
template <class T>
void add_coordinates_of(const GeometryOf<T>& geometry, int body, std::vector<std::size_t>& list) {
  for (; body >= 0; body = geometry.bodies[static_cast<std::size_t>(body)].parent) {
    const BodyOf<T>& b = geometry.bodies[static_cast<std::size_t>(body)];
    for (const auto* entries : {&b.position, &b.angles}) {
      for (const PoseEntryOf<T>& entry : *entries) {
        if (entry.coordinate >= 0) list.push_back(static_cast<std::size_t>(entry.coordinate));
      }
    }
  }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

/// M of a geometry at `q`, (2): n_q rows.
template <class T>
std::vector<std::vector<T>> mass_matrix_of(const GeometryOf<T>& geometry, const std::vector<T>& q) {
  std::vector<std::vector<T>> M(q.size(), std::vector<T>(q.size(), T(0)));
  for (std::size_t i = 0; i < geometry.bodies.size(); ++i) {
    const BodyOf<T>& body = geometry.bodies[i];
    const BodyMotion<T> motion = motion_of(geometry, static_cast<int>(i), q);
    std::vector<std::size_t> coordinates;
    add_coordinates_of(geometry, static_cast<int>(i), coordinates);
    for (const std::size_t row : coordinates) {
      const Vector3<T> turn = times_transposed(motion.R, motion.J_omega[row]);
      for (const std::size_t column : coordinates) {
        const Vector3<T> other_turn = times_transposed(motion.R, motion.J_omega[column]);
        M[row][column] += body.mass * dot(motion.J_centre[row], motion.J_centre[column]);
        for (std::size_t axis = 0; axis < 3; ++axis)
          M[row][column] += body.inertia[axis] * turn[axis] * other_turn[axis];
      }
    }
  }
  return M;
}

/// Generalised weight of a geometry at `q`, the sum of m J_p' gravity, n_q.
template <class T>
std::vector<T> weight_of(const GeometryOf<T>& geometry, const std::vector<T>& q) {
  std::vector<T> weight(q.size(), T(0));
  for (std::size_t i = 0; i < geometry.bodies.size(); ++i) {
    const BodyMotion<T> motion = motion_of(geometry, static_cast<int>(i), q);
    std::vector<std::size_t> coordinates;
    add_coordinates_of(geometry, static_cast<int>(i), coordinates);
    for (const std::size_t k : coordinates)
      weight[k] += geometry.bodies[i].mass * dot(motion.J_centre[k], geometry.gravity);
  }
  return weight;
}

/// The pose of a `shape` in the axes of its body.
template <class T>
PoseOf<T> pose_on_body(const BodyShapeOf<T>& shape) {
  return {shape.position, geometry_detail::cardan(shape.angles)};
}

/// The touching point of the shapes of a `pair`, (3) to (5), with the poses `pose_1` and `pose_2`.
template <class T>
Touch<T> touch_of(const GeometryOf<T>& geometry, const ShapePair& pair, const PoseOf<T>& pose_1,
                  const PoseOf<T>& pose_2) {
  using std::sqrt;
  const BodyShapeOf<T>& first = geometry.shapes[static_cast<std::size_t>(pair.first)];
  const BodyShapeOf<T>& second = geometry.shapes[static_cast<std::size_t>(pair.second)];
  const std::size_t up = geometry.in_space ? 2 : 1;

  const auto ball = geometry_detail::ball_of(second, pair.corner);
  const Vector3<T> c_2 = sum(pose_2.centre, times(pose_2.R, ball.centre));
  const Vector3<T> d = difference(c_2, pose_1.centre);
  Touch<T> touch;
  T distance, radius = ball.radius;
  if (first.kind == ShapeKind::sphere) {  // (4)
    const T length = sqrt(dot(d, d));
    touch.normal = scaled(1 / length, d);
    distance = length - first.size[0];
    touch.tangents =
        geometry.in_space ? tangents_of(touch.normal) : std::array{plane_tangent_of(touch.normal), Vector3<T>{}};
  } else if (first.kind == ShapeKind::polygon) {  // (3a)
    const auto nearest =
        geometry_detail::nearest_of(first, times_transposed(pose_1.R, d), !geometry_detail::is_zero(ball.radius));
    touch.normal = times(pose_1.R, nearest.normal);
    distance = nearest.distance;
    touch.tangents = {plane_tangent_of(touch.normal), Vector3<T>{}};
  } else {  // (3)
    touch.normal = column_of(pose_1.R, up);
    distance = dot(touch.normal, d);
    if (first.kind == ShapeKind::box) distance -= first.size[up];
    for (std::size_t k = 0; k < 3; ++k)
      radius += ball.support[k] * magnitude(dot(touch.normal, column_of(pose_2.R, k)));  // (5)
    touch.tangents = {column_of(pose_1.R, 0), geometry.in_space ? column_of(pose_1.R, 1) : Vector3<T>{}};
  }
  touch.gap = distance - radius;
  touch.point = difference(c_2, scaled(radius, touch.normal));
  return touch;
}

/// The contact of a `pair` of the geometry at `q`, (3) to (6).
template <class T>
ShapeContact<T> contact_of(const GeometryOf<T>& geometry, const ShapePair& pair, const std::vector<T>& q) {
  const BodyShapeOf<T>& first = geometry.shapes[static_cast<std::size_t>(pair.first)];
  const BodyShapeOf<T>& second = geometry.shapes[static_cast<std::size_t>(pair.second)];
  const BodyMotion<T> motion_1 = motion_of(geometry, first.body, q), motion_2 = motion_of(geometry, second.body, q);
  ShapeContact<T> contact{
      touch_of(geometry, pair, motion_1.carries(pose_on_body(first)), motion_2.carries(pose_on_body(second))), {}, {}};
  const Vector3<T> x_1 = difference(contact.point, scaled(contact.gap, contact.normal));
  contact.J_n.assign(q.size(), T(0));
  contact.J_t.assign(geometry.in_space ? 2 : 1, contact.J_n);
  std::vector<std::size_t> coordinates;
  add_coordinates_of(geometry, first.body, coordinates);
  add_coordinates_of(geometry, second.body, coordinates);
  for (const std::size_t k : coordinates) {  // (6)
    const Vector3<T> column = difference(motion_2.velocity_column(k, contact.point), motion_1.velocity_column(k, x_1));
    contact.J_n[k] = dot(column, contact.normal);
    for (std::size_t t = 0; t < contact.J_t.size(); ++t) contact.J_t[t][k] = dot(column, contact.tangents[t]);
  }
  return contact;
}

/// The gaps of all pairs of a geometry at `q`, in their order [m].
template <class T>
std::vector<T> geometry_gaps(const GeometryOf<T>& geometry, const std::vector<T>& q) {
  std::vector<T> gaps;
  for (const ShapePair& pair : geometry.pairs) gaps.push_back(contact_of(geometry, pair, q).gap);
  return gaps;
}

}  // namespace ricochet
