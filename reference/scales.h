#pragma once

#include "problems/problem.h"

namespace ricochet::reference {

/// Fractions of a size of Scales below which a quantity counts as zero.
///
/// Rounding of one solved law: its inequalities may be violated by this fraction of their terms.
constexpr double kLawRounding = 1e-12;
/// Motions and forces of two solutions of a law that count as equal, or as zero: far above the rounding of either and
/// far below a real difference.
constexpr double kSame = 1e-9;
/// Gaps and slip or normal velocities of a closed contact due to rounding.
constexpr double kTouching = 1e-13, kResting = 1e-12;

/// Sizes for thresholds, in the units of the scene. A threshold relative to the current value would vanish with it, at
/// rest or after an impact that stops everything, and an absolute one in SI units would have a different meaning in
/// every scene. The sizes are therefore those of a group of coupled coordinates at the start, and remain constant:
///
///   tau = T / 10                                                                         (1)
///   V_k = min(sqrt(2 E / M_kk), max_l w_l),  w_l = |v0_l| + tau |a_l|,  2 E = sum_l M_ll w_l^2     (2)
///   Q_k = tau V_k                                                                        (3)
///   P_i = V_n / (J_n' M^-1 J_n),  V_n = |J_n|' V,  F_i = P_i / tau                       (4)
///
/// a is the acceleration without contacts at the start; for a body at rest, its effect over a tenth of the run defines
/// the size. l are the coordinates that forces, masses and contacts couple with k. The energy E gives lengths and
/// angles consistent sizes in all units. The maximum prevents a body of great mass, for example one with a prescribed
/// motion, from determining the sizes of small ones. A group without velocity and force has the sizes of the whole
/// problem, or 1 m/s if everything is at rest.
class Scales {
 public:
  /// @param tau  replaces (1) [s]
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
