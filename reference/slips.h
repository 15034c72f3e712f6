#pragma once

#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/slip_start.h"

namespace ricochet::reference {

/// The slip of closed contacts with friction. Its root function
///
///   d' v_t + offset                                                                      (1)
///
/// crosses zero downwards when slip ends. In the plane, d is the sign of the slip and the offset is zero. In space, d
/// is updated after every step, and the offset is -v_stop: an integrator cannot cross the end of the slip, where the
/// direction v_t / |v_t| has no limit, so finish() treats the last v_stop of the velocity. A new slip has v_t = 0;
/// until it is faster than 2 v_stop, its offset is +v_stop, and a root then means that the contact moves against its
/// own direction.
class Slips {
 public:
  /// @param tolerance  of the integration; the others must outlive this object
  Slips(const Problem& problem, const Scales& scales, ContactDynamics& dynamics, double tolerance);

  bool has_friction(int i) const { return problem_.info().contacts[i].n_t > 0; }
  bool is_new(int i) const { return slips_[static_cast<std::size_t>(i)].is_new; }
  const Vector& direction(int i) const { return slips_[static_cast<std::size_t>(i)].direction; }

  /// (1) for a slipping contact. @param J_t  packed, of all contacts
  double root(int i, const double* J_t, const double* v) const;

  /// Slip velocity of contact i, and the size of its terms.
  Vector velocity(int i, const Matrix& J_t, const Vector& v) const { return tangents(i, J_t).transpose() * v; }
  double size(int i, const Matrix& J_t, const Vector& v) const { return scales_.speed(tangents(i, J_t), v).maxCoeff(); }
  /// Whether the slip velocity is zero to rounding.
  bool rests(int i, const Matrix& J_t, const Vector& v) const {
    return velocity(i, J_t, v).norm() <= kResting * size(i, J_t, v);
  }

  /// Updates directions in space, and slips that are no longer new, after a step.
  void follow(const Vector& q, const Vector& v);

  /// Finds the contacts at a root of (1) whose slip ends. In space, a slip at a root still has the speed v_stop; until
  /// it ends, the state moves with constant acceleration. The remaining turn of the direction is neglected, so the
  /// errors of time and velocity are v_stop times that angle and v_stop^2 over the deceleration. A slip that only comes
  /// close to zero continues, and its v_stop becomes half of its speed.
  /// @param left  longest duration [s]; @param duration  actual duration [s]
  std::vector<int> finish(const std::vector<int>& at_root, double left, double& duration, Vector& q, Vector& v);

  /// Starts after an event, with the modes of the dynamics.
  /// @param directions  by contact; @param begins  contacts whose slip starts from rest
  void renew(const std::vector<Vector>& directions, const std::vector<char>& begins, const Vector& q, const Vector& v);

  /// New slip in space that the integrator cannot follow yet, and the speed from which it can follow.
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
