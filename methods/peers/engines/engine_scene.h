#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "methods/method.h"
#include "problems/geometry.h"
#include "problems/geometry_kinematics.h"

/// @file
/// A scene as an engine sees it: free rigid bodies, their shapes, and the pairs that may touch, with maps between the
/// scene's coordinates and the engine's positions, rotations and velocities.
///
/// Apart from contacts, bodies are subject to f(q, v) of the scene without the inertial forces of its coordinates,
/// which an engine computes itself:
///
///     f_ext = f + (d(M v)/dq) v - 1/2 (d(M v)/dq)' v,     J_p' F = f_ext at positions, J_omega' tau = f_ext at angles   (1)

namespace ricochet {

/// Pose and velocities of a body, in the axes of the world.
struct BodyState {
  Pose pose;                 ///< centre of mass, rotation
  Vector3<double> velocity;  ///< of the centre [m/s]
  Vector3<double> omega;     ///< [rad/s]
};

/// Force and torque on a body, in the axes of the world.
struct Wrench {
  Vector3<double> force;   ///< at the centre [N]
  Vector3<double> torque;  ///< about it [N m]
};

/// Two shapes that may touch, with the properties of their contacts. A box on a plane is one pair to an engine.
struct EnginePair {
  int first = 0;   ///< of Geometry::shapes
  int second = 0;  ///< of Geometry::shapes
  double eps_r = 0;
  double mu = 0;
};

/// See above. Holds references to the problem.
class EngineScene {
 public:
  /// Whether engines support the bodies of a scene, or why not.
  /// @param has_joint_friction  the engine has dry friction with a constant bound along a coordinate of a body
  static Support supports(const ProblemInfo& info, bool has_joint_friction);

  /// @param problem  whose geometry supports() takes
  explicit EngineScene(const Problem& problem);

  const Problem& problem() const { return problem_; }                                       ///< The scene.
  const Geometry& geometry() const { return *problem_.info().geometry; }                    ///< Its bodies and shapes.
  const Body& body(int i) const { return geometry().bodies[static_cast<std::size_t>(i)]; }  ///< One of them.
  const BodyShape& shape(int i) const { return geometry().shapes[static_cast<std::size_t>(i)]; }  ///< One of them.
  int n_bodies() const { return static_cast<int>(geometry().bodies.size()); }                     ///< That move.
  const std::vector<EnginePair>& pairs() const { return pairs_; }                                 ///< That may touch.
  /// Bound of the friction elements along a coordinate [N, N m]; 0: none.
  double joint_friction(int coordinate) const { return joint_friction_[coordinate]; }
  /// The pair of two shapes, whichever comes first; null where they may pass through each other.
  const EnginePair* pair_of(int shape, int other) const;
  /// Shapes of a body, or of the world (-1), that are in some pair.
  std::vector<int> touching_shapes_of(int body) const;
  /// A coordinate moves the body along this axis of the world.
  bool moves_along(int body, int axis) const;
  bool turns(int body) const { return this->body(body).rotation != BodyRotation::none; }  ///< Coordinates turn it.
  /// It turns about all axes.
  bool turns_in_space(int body) const { return turns(body) && this->body(body).rotation != BodyRotation::planar; }

  /// States of the bodies at (q, v), n_q entries each.
  std::vector<BodyState> states_of(const Vector& q, const Vector& v) const;
  /// (q, v) of the bodies' `states`, where `q` holds coordinates of `h` seconds before: angles continue from there.
  void coordinates_of(std::span<const BodyState> states, double h, Vector& q, Vector& v) const;

  /// Whether only the geometry's gravity acts on bodies: the gravity of the engine is then enough.
  bool has_only_weight() const { return has_only_weight_; }
  /// (1) at (q, v).
  void wrenches(const Vector& q, const Vector& v, std::span<Wrench> wrenches) const;

 private:
  Vector external_force(const Vector& q, const Vector& v) const;
  bool is_weight_alone() const;

  const Problem& problem_;
  std::vector<EnginePair> pairs_;
  Vector joint_friction_;  ///< n_q
  bool has_only_weight_ = false;
};

}  // namespace ricochet
