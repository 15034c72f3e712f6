#pragma once

#include <array>
#include <string>
#include <vector>

/// @file
/// What the rigid bodies of a scene look like and weigh: what a drawing shows and what an engine has to be told. The
/// equations of a scene do not need it; where it is stated, gaps follow from it, too, and a test compares the two.

namespace ricochet {

/// A number of a pose: q[coordinate] + offset, or `offset` alone [m or rad].
struct PoseEntry {
  int coordinate = -1;  ///< of q; -1 where the number is constant
  double offset = 0;    ///< added to it
};

/// A rigid body. The world's axes are x to the right and y upwards in the plane, z upwards in space.
struct Body {
  /// How coordinates turn a body.
  enum class Rotation {
    none,    ///< it never turns
    planar,  ///< by angles[0] about z
    cardan,  ///< R = R_x(angles[0]) R_y(angles[1]) R_z(angles[2])
    spin     ///< angles are integrals of the angular velocity in world axes: only bodies whose shapes do not show it
  };

  std::string name;                     ///< in tables and drawings
  double mass = 0;                      ///< [kg]
  std::array<double, 3> inertia{};      ///< principal moments about the centre, along the body's axes [kg m^2]
  std::array<PoseEntry, 3> position{};  ///< of the centre of mass
  Rotation rotation = Rotation::none;   ///< which of `angles` mean something
  std::array<PoseEntry, 3> angles{};    ///< see Rotation
};

/// A shape fixed to a body, or to the world.
struct BodyShape {
  /// What `size` means.
  enum class Kind {
    sphere,     ///< radius; in the plane a disc
    box,        ///< half edges along the shape's x, y, z; in the plane x, y
    capsule,    ///< radius, half length along the shape's x
    half_space  ///< the solid side of a plane through `position`, whose outer normal is the shape's y (z in space)
  };

  Kind kind = Kind::sphere;          ///< which
  int body = -1;                     ///< of Geometry::bodies; -1 for the world
  std::array<double, 3> size{};      ///< see Kind [m]
  std::array<double, 3> position{};  ///< of its centre in the body's axes [m]
  std::array<double, 3> angles{};    ///< Cardan angles as of Body::Rotation::cardan, shape against body [rad]
};

/// Which contact of the scene acts between two shapes.
struct ShapePair {
  int contact = 0;  ///< of ProblemInfo::contacts
  int first = 0;    ///< of Geometry::shapes; the gap grows when `second` moves away from it
  int second = 0;   ///< of Geometry::shapes
  int corner = -1;  ///< of `second`, a box: bit k is set where its coordinate along axis k is positive; -1: all of it
};

/// All of it.
struct Geometry {
  bool in_space = false;          ///< three dimensions; else the plane z = 0
  std::vector<Body> bodies;       ///< those that move
  std::vector<BodyShape> shapes;  ///< of bodies and of the world
  std::vector<ShapePair> pairs;   ///< contacts; a box on a plane has one pair for each corner
};

}  // namespace ricochet
