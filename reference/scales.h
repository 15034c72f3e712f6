#pragma once

#include "problems/problem.h"

namespace ricochet::reference {

/// Parts of a size, as Scales states it, that something may have and count as zero.
///
/// Rounding of one law solved: its inequalities may be violated by this part of their terms.
constexpr double kLawRounding = 1e-12;
/// Motions and forces that two solutions of a law share, or that are zero: far above the rounding of either and far
/// below a choice.
constexpr double kSame = 1e-9;
/// Gaps and slip or normal velocities that rounding leaves of a closed contact.
constexpr double kTouching = 1e-13, kResting = 1e-12;

/// Sizes that thresholds are parts of, in the units of the scene. A threshold that is a part of what it measures
/// vanishes with it, at rest or behind an impact that stops everything, and one in SI units means another thing in
/// every scene. So sizes are those that a group of coordinates that act on each other has at the start, and keeps:
///
///   tau = T / 10                                                                         (1)
///   V_k = min(sqrt(2 E / M_kk), max_l w_l),  w_l = |v0_l| + tau |a_l|,  2 E = sum_l M_ll w_l^2     (2)
///   Q_k = tau V_k                                                                        (3)
///   P_i = V_n / (J_n' M^-1 J_n),  V_n = |J_n|' V,  F_i = P_i / tau                       (4)
///
/// with a the acceleration without contacts at the start: what is at rest is measured against what its forces will do
/// in a tenth of the run. l are the coordinates that forces, masses and contacts couple with k. The energy E gives
/// lengths and angles sizes that fit each other in any units; the maximum keeps a body of great mass, as one that
/// stands for a prescribed motion, from lending its energy to small ones. A group without velocity and force is never
/// moved by itself: it takes the sizes of the whole problem, and 1 m/s where that is at rest for good.
class Scales {
 public:
  /// @param tau  of (1), where it is another one [s]
  Scales(const Problem& problem, double tau);
  explicit Scales(const Problem& problem) : Scales(problem, problem.info().end_time / 10) {}

  double time() const { return tau_; }
  const Vector& position() const { return Q_; }  ///< n_q
  const Vector& velocity() const { return V_; }  ///< n_q

  const Vector& impulse() const { return P_; }  ///< n_c, of contacts
  const Vector& force() const { return F_; }    ///< n_c, of contacts

  /// Sizes of the terms of J' q, J' v and J' a, for one column or all columns of a Jacobian.
  Vector gap(const Matrix& J, const Vector& q) const { return J.cwiseAbs().transpose() * (q.cwiseAbs() + Q_); }
  Vector speed(const Matrix& J, const Vector& v) const { return J.cwiseAbs().transpose() * (v.cwiseAbs() + V_); }

 private:
  double tau_;
  Vector Q_, V_, P_, F_;
};

}  // namespace ricochet::reference
