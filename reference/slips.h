#pragma once

#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/slip_start.h"

namespace ricochet::reference {

/// The slip of closed contacts with friction, as root finding follows it: the root function
///
///   d' v_t + offset                                                                      (1)
///
/// falls through zero where slip ends. In the plane d is the sign of the slip and the offset zero. In space d follows
/// the slip, step after step, and the offset is -v_stop: the direction v_t / |v_t| has no limit that an integrator
/// could cross, so the last v_stop of the velocity is left to finish(). A slip that has just begun has v_t = 0; until
/// it is faster than 2 v_stop its offset is +v_stop, and a root then says that the contact moves against its own
/// direction.
class Slips {
 public:
  /// @param tolerance  of the integration; the others have to outlive this
  Slips(const Problem& problem, const Scales& scales, ContactDynamics& dynamics, double tolerance);

  bool has_friction(int i) const { return problem_.info().contacts[i].n_t > 0; }
  bool is_new(int i) const { return slips_[static_cast<std::size_t>(i)].is_new; }
  const Vector& direction(int i) const { return slips_[static_cast<std::size_t>(i)].direction; }

  /// (1) of a contact that slips. @param J_t  packed, of all contacts
  double root(int i, const double* J_t, const double* v) const;

  /// Slip velocity of contact i, and the size of its terms.
  Vector velocity(int i, const Matrix& J_t, const Vector& v) const { return tangents(i, J_t).transpose() * v; }
  double size(int i, const Matrix& J_t, const Vector& v) const { return scales_.speed(tangents(i, J_t), v).maxCoeff(); }
  /// Whether it is zero to rounding.
  bool rests(int i, const Matrix& J_t, const Vector& v) const {
    return velocity(i, J_t, v).norm() <= kResting * size(i, J_t, v);
  }

  /// Behind a step: directions in space, and slips that are no longer new.
  void follow(const Vector& q, const Vector& v);

  /// The contacts at a root of (1) whose slip ends. In space the last v_stop of it takes time, in which the state moves
  /// on with its acceleration held. The direction is fixed up to what it still turns, so time and velocity are wrong by
  /// v_stop times that angle and by v_stop^2 over the deceleration. A slip that only passes close to zero goes on, and
  /// its v_stop becomes half of its speed.
  /// @param left  longest duration [s]; @param duration  that was taken
  std::vector<int> finish(const std::vector<int>& at_root, double left, double& duration, Vector& q, Vector& v);

  /// Contacts that slip behind an event, with the modes of the dynamics.
  /// @param directions  by contact; @param begins  contacts whose slip begins from rest
  void renew(const std::vector<Vector>& directions, const std::vector<char>& begins, const Vector& q, const Vector& v);

  /// New slip in space that the integrator cannot follow yet, and the speed from which it can.
  std::vector<BeginningSlip> beginning(const Vector& q, const Vector& v) const;

 private:
  struct Slip {
    Vector direction;     ///< d
    double v_stop = 0;    ///< [m/s]
    bool is_new = false;  ///< not yet faster than 2 v_stop
  };

  Eigen::Block<const Matrix, Eigen::Dynamic, Eigen::Dynamic, true> tangents(int i, const Matrix& J_t) const {
    const auto& contact = problem_.info().contacts[i];
    return J_t.middleCols(contact.tangent_index, contact.n_t);
  }
  double v_stop(int i, const Matrix& J_t, const Vector& v) const;
  bool would_stick(int i, const Vector& q, const Vector& v);
  bool accelerate(const Vector& q, const Vector& v);

  const Problem& problem_;
  const Scales& scales_;
  ContactDynamics& dynamics_;
  const double tolerance_;
  std::vector<Slip> slips_;
  Vector a_, lambda_n_, lambda_t_;
};

}  // namespace ricochet::reference
