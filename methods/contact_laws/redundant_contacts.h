#pragma once

#include "methods/contact_laws/contact_problem.h"

namespace ricochet {

/// Impulses that move nothing. The Delassus operator G = D' M^-1 D has the null space of D: impulses in it cancel each
/// other on every body and change no velocity. A box on four corners with friction has six such directions, and the
/// contact laws do not determine all of its reactions.
///
///   r = r_0 + r_1,   r_0 in null(G), r_1 normal to it: ||r_0|| is the internal force                      (1)
///
/// A solver cannot choose r_0 freely, since the impulses must stay in the friction cones. Its choice is compared with
/// the least-norm solution: of all solutions with the velocities of r,
///
///   r* = argmin ||x||   over   x - r in null(G),  x in F_1 x F_2 x ...                                    (2)
///
/// with F_i the part of the friction cone that goes with the velocity of contact i: {0} where it opens, the ray against
/// slip where it slips, else the whole cone.
///
/// A direction of relative stiffness 1e-13, eigenvalue over the largest, counts as one in the null space. Dense, for
/// studies and not for the time step.
class RedundantContacts {
 public:
  explicit RedundantContacts(const ContactProblem& problem);

  int n_rows() const { return static_cast<int>(values_.size()); }
  int n_redundant() const { return n_null_; }  ///< dimension of null(G)
  /// Condition number of the part of G that is not redundant: largest over smallest eigenvalue.
  double condition() const;

  Vector internal_part(const Vector& r) const;  ///< r_0 of (1)
  /// (2), by Dykstra's alternating projections from 0.
  /// @param tolerance  of the velocities by which contacts count as open or slipping, as a fraction of the largest; r
  /// must be a solution up to it
  Vector least_norm(const ContactProblem& problem, const Vector& r, double tolerance) const;

 private:
  Vector values_;  // eigenvalues, ascending
  Matrix null_;    // n x n_null, orthonormal
  int n_null_ = 0;
};

}  // namespace ricochet
