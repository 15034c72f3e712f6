#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

/// @file
/// Bodies, masses and shapes of a scene, as drawings and engines need them. Gaps, tangents, M and the weight follow
/// from the geometry (geometry_kinematics.h). If a scene states formulas as well, both describe the same motion, and a
/// test compares them.
///
/// The axes of the world are x to the right and y upwards in the plane, z upwards in space. Where the coordinates of a
/// scene lie along a ramp, its geometry does, too, and gravity defines the direction down.

namespace ricochet {

/// How coordinates turn a body.
enum class BodyRotation {
  none,    ///< the body never turns
  planar,  ///< rotation by angles[0] about z
  cardan,  ///< R = R_x(angles[0]) R_y(angles[1]) R_z(angles[2])
  spin     ///< angles are integrals of the angular velocity in world axes: only bodies whose shapes do not show it
};

/// Kind of a shape, which determines the meaning of its size.
enum class ShapeKind {
  sphere,      ///< radius; in the plane a disc
  box,         ///< half edges along the shape's x, y, z; in the plane x, y
  capsule,     ///< radius, half length along the shape's x
  half_space,  ///< the solid side of a plane through `position`, whose outer normal is the shape's y (z in space)
  polygon      ///< in the plane: faces between `corners`, solid on their left; convex and closed, or an open chain
};

/// A number of a pose: q[coordinate] + offset, or `offset` alone [m or rad].
template <class T>
struct PoseEntryOf {
  int coordinate = -1;  ///< index in q; -1 if the number is constant
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
  Rotation rotation = Rotation::none;        ///< which of `angles` are used
  std::array<PoseEntryOf<T>, 3> angles{};    ///< see Rotation; relative to the world, even with a parent
  int parent = -1;                           ///< `position` is in this body's axes, from its centre; -1: in the world's
  std::array<T, 3> centre_from_pivot{};      ///< in the body's axes, from `position` to the centre of mass [m]
};

/// A shape fixed to a body, or to the world.
template <class T>
struct BodyShapeOf {
  using Kind = ShapeKind;  ///< Meaning of `size`.

  Kind kind = Kind::sphere;     ///< which
  int body = -1;                ///< of Geometry::bodies; -1 for the world
  std::array<T, 3> size{};      ///< see Kind [m]
  std::array<T, 3> position{};  ///< of its centre in the body's axes, from the centre of mass [m]
  std::array<T, 3> angles{};    ///< Cardan angles as in BodyRotation::cardan, of the shape relative to the body [rad]
  std::string name{};           ///< in scene files; no other shape has it
  /// Of a polygon, in its axes [m]. If its turns go to the left, the solid is the intersection of the half-planes of its
  /// faces. The turns of an open chain may go to the right: the solid is their union then.
  std::vector<std::array<T, 3>> corners{};
  bool is_open = false;     ///< a chain, whose first and last face have no end
  bool is_concave = false;  ///< a chain with turns to the right
};

/// A contact of the scene between two shapes; geometry_kinematics.h defines the points that touch.
struct ShapePair {
  int contact = 0;  ///< of ProblemInfo::contacts
  int first = 0;    ///< of Geometry::shapes; the gap grows when `second` moves away from it
  int second = 0;   ///< of Geometry::shapes
  int corner = -1;  ///< corner of `second`; for a box, bit k is set if the coordinate along axis k is positive; for a
                    ///< capsule, bit 0 is its end; the number of that of a polygon; -1: the whole shape
};

/// A line between points of two bodies, a spring or a massless rod, which only drawings show.
template <class T>
struct LinkOf {
  int first = -1;                   ///< of Geometry::bodies; -1 for the world
  int second = -1;                  ///< the other
  std::array<T, 3> first_point{};   ///< in its axes, from its centre of mass [m]
  std::array<T, 3> second_point{};  ///< the same of the other
};

/// A geometry, in numbers or in formulas of the parameters.
template <class T>
struct GeometryOf {
  bool in_space = false;                 ///< three dimensions; else the plane z = 0
  std::vector<BodyOf<T>> bodies{};       ///< the moving bodies; a parent precedes the bodies that it carries
  std::vector<BodyShapeOf<T>> shapes{};  ///< of bodies and of the world
  std::vector<ShapePair> pairs{};        ///< contacts; a box on a plane has one pair for each corner
  std::array<T, 3> gravity{};            ///< acceleration of everything [m/s^2]
  std::vector<LinkOf<T>> links{};        ///< lines in drawings

  /// Adds a `body`. @return its number
  int add_body(BodyOf<T> body) {
    bodies.push_back(std::move(body));
    return static_cast<int>(bodies.size()) - 1;
  }
  /// Adds a `shape`, and names it if it has no name. @return its number
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
      for (std::array<T, 3>& corner : shape.corners) all(corner);
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

/// `geometry` with all numbers set to zero.
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
    other.add_shape({.kind = shape.kind,
                     .body = shape.body,
                     .name = shape.name,
                     .corners = std::vector<std::array<To, 3>>(shape.corners.size()),
                     .is_open = shape.is_open,
                     .is_concave = shape.is_concave});
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

/// Whether the pose of a `body` consists of its own coordinates, as in engines, without a parent or a pivot.
inline bool has_own_coordinates(const Body& body) {
  return body.parent < 0 && body.centre_from_pivot == std::array<double, 3>{};
}

}  // namespace ricochet
