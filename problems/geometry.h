#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

/// @file
/// What the rigid bodies of a scene look like and weigh: what a drawing shows and what an engine has to be told. Gaps,
/// tangents, M and the weight follow from it (geometry_kinematics.h). A scene that states formulas, too, says the same
/// twice, and a test compares the two.
///
/// The axes of the world are x to the right and y upwards in the plane, z upwards in space. Where the coordinates of a
/// scene lie along a ramp, its geometry does, too, and gravity says where down is.

namespace ricochet {

/// How coordinates turn a body.
enum class BodyRotation {
  none,    ///< it never turns
  planar,  ///< by angles[0] about z
  cardan,  ///< R = R_x(angles[0]) R_y(angles[1]) R_z(angles[2])
  spin     ///< angles are integrals of the angular velocity in world axes: only bodies whose shapes do not show it
};

/// What the size of a shape means.
enum class ShapeKind {
  sphere,     ///< radius; in the plane a disc
  box,        ///< half edges along the shape's x, y, z; in the plane x, y
  capsule,    ///< radius, half length along the shape's x
  half_space  ///< the solid side of a plane through `position`, whose outer normal is the shape's y (z in space)
};

/// A number of a pose: q[coordinate] + offset, or `offset` alone [m or rad].
template <class T>
struct PoseEntryOf {
  int coordinate = -1;  ///< of q; -1 where the number is constant
  T offset{0};          ///< added to it
};

/// A rigid body.
template <class T>
struct BodyOf {
  using Rotation = BodyRotation;  ///< How coordinates turn it.

  std::string name{};                        ///< in tables and drawings; no other body has it
  T mass{0};                                 ///< [kg]
  std::array<T, 3> inertia{};                ///< principal moments about the centre, along the body's axes [kg m^2]
  std::array<PoseEntryOf<T>, 3> position{};  ///< of the centre of mass, or of a pivot, see below
  Rotation rotation = Rotation::none;        ///< which of `angles` mean something
  std::array<PoseEntryOf<T>, 3> angles{};    ///< see Rotation; against the world, with a parent, too
  int parent = -1;                           ///< `position` is in this body's axes, from its centre; -1: in the world's
  std::array<T, 3> centre_from_pivot{};  ///< in the body's axes: the centre of mass is there, seen from `position` [m]
};

/// A shape fixed to a body, or to the world.
template <class T>
struct BodyShapeOf {
  using Kind = ShapeKind;  ///< What `size` means.

  Kind kind = Kind::sphere;     ///< which
  int body = -1;                ///< of Geometry::bodies; -1 for the world
  std::array<T, 3> size{};      ///< see Kind [m]
  std::array<T, 3> position{};  ///< of its centre in the body's axes, from the centre of mass [m]
  std::array<T, 3> angles{};    ///< Cardan angles as of BodyRotation::cardan, shape against body [rad]
  std::string name{};           ///< in scene files; no other shape has it
};

/// Which contact of the scene acts between two shapes: geometry_kinematics.h says which points touch.
struct ShapePair {
  int contact = 0;  ///< of ProblemInfo::contacts
  int first = 0;    ///< of Geometry::shapes; the gap grows when `second` moves away from it
  int second = 0;   ///< of Geometry::shapes
  int corner = -1;  ///< of `second`, a box: bit k is set where its coordinate along axis k is positive; of a capsule:
                    ///< bit 0, its end; -1: all of it
};

/// A line between points of two bodies, a spring or a rod without mass: only drawings show it.
template <class T>
struct LinkOf {
  int first = -1;                   ///< of Geometry::bodies; -1 for the world
  int second = -1;                  ///< the other
  std::array<T, 3> first_point{};   ///< in its axes, from its centre of mass [m]
  std::array<T, 3> second_point{};  ///< the same of the other
};

/// All of it, in numbers or in formulas of the parameters.
template <class T>
struct GeometryOf {
  bool in_space = false;                 ///< three dimensions; else the plane z = 0
  std::vector<BodyOf<T>> bodies{};       ///< those that move; a parent stands before those it carries
  std::vector<BodyShapeOf<T>> shapes{};  ///< of bodies and of the world
  std::vector<ShapePair> pairs{};        ///< contacts; a box on a plane has one pair for each corner
  std::array<T, 3> gravity{};            ///< acceleration of everything [m/s^2]
  std::vector<LinkOf<T>> links{};        ///< what else a drawing shows

  /// Adds a `body`. @return its number
  int add_body(BodyOf<T> body) {
    bodies.push_back(std::move(body));
    return static_cast<int>(bodies.size()) - 1;
  }
  /// Adds a `shape`, and names it where it has no name. @return its number
  int add_shape(BodyShapeOf<T> shape) {
    if (shape.name.empty()) shape.name = "shape " + std::to_string(shapes.size());
    shapes.push_back(std::move(shape));
    return static_cast<int>(shapes.size()) - 1;
  }

  /// Calls `visit`(T&) with every number of the geometry, in an order that depends on its structure alone.
  template <class Visit>
  void for_each_number(Visit visit) {
    const auto all = [&](std::array<T, 3>& numbers) {
      for (T& x : numbers) visit(x);
    };
    for (BodyOf<T>& body : bodies) {
      visit(body.mass);
      all(body.inertia);
      for (auto* entries : {&body.position, &body.angles}) {
        for (PoseEntryOf<T>& entry : *entries) visit(entry.offset);
      }
      all(body.centre_from_pivot);
    }
    for (BodyShapeOf<T>& shape : shapes) {
      for (auto* numbers : {&shape.size, &shape.position, &shape.angles}) all(*numbers);
    }
    all(gravity);
    for (LinkOf<T>& link : links) {
      for (auto* point : {&link.first_point, &link.second_point}) all(*point);
    }
  }
};

/// A right angle, which turns the normal of a half-space from y to -x.
template <class T>
T quarter_turn() {
  using std::atan;
  return 2 * atan(T(1));
}

/// All of `geometry` but its numbers, which are zero.
template <class To, class From>
GeometryOf<To> without_numbers(const GeometryOf<From>& geometry) {
  const auto entries = [](const std::array<PoseEntryOf<From>, 3>& from) {
    std::array<PoseEntryOf<To>, 3> to;
    for (std::size_t k = 0; k < 3; ++k) to[k].coordinate = from[k].coordinate;
    return to;
  };
  GeometryOf<To> other;
  other.in_space = geometry.in_space;
  for (const BodyOf<From>& body : geometry.bodies) {
    other.add_body({.name = body.name,
                    .position = entries(body.position),
                    .rotation = body.rotation,
                    .angles = entries(body.angles),
                    .parent = body.parent});
  }
  for (const BodyShapeOf<From>& shape : geometry.shapes)
    other.add_shape({.kind = shape.kind, .body = shape.body, .name = shape.name});
  other.pairs = geometry.pairs;
  for (const LinkOf<From>& link : geometry.links) other.links.push_back({.first = link.first, .second = link.second});
  return other;
}

using PoseEntry = PoseEntryOf<double>;  ///< In numbers.
using Body = BodyOf<double>;            ///< In numbers.
using BodyShape = BodyShapeOf<double>;  ///< In numbers.
using Link = LinkOf<double>;            ///< In numbers.
/// In numbers.
struct Geometry : GeometryOf<double> {};

/// The pose of a `body` is coordinates of its own, as engines have them: it hangs on no other body and on no pivot.
inline bool has_own_coordinates(const Body& body) {
  return body.parent < 0 && body.centre_from_pivot == std::array<double, 3>{};
}

}  // namespace ricochet
