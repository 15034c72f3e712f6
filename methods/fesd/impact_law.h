#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "methods/complementarity/lemke.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// What happens at one instant to the contacts that touch:
///
///   M(q) (v+ - v-) = sum_i J_n^i Lambda_n^i                                             (1)
///   0 <= Lambda_n^i  _|_  J_n^i' (v+ + eps_r^i v-) >= 0,   f_c^i(q) = 0                 (2)
///
/// Source: paper eq. (impulse_eq_comp), with the inequality that keeps contacts without impulse from penetrating
/// (correction 9 of the specification). And which of them stay closed afterwards:
///
///   M(q) w = f_v + B_u u + sum_i J_n^i lambda_n^i                                       (3)
///   0 <= lambda_n^i  _|_  J_n^i' w + v+' (grad^2 f_c^i) v+ >= 0                         (4)
///
/// Both are linear complementarity problems with the Delassus matrix G = J_n' M^-1 J_n.
class ImpactLaw {
 public:
  ImpactLaw(const Problem& problem, Counters& counters);

  /// Evaluates M and J_n at q for the contacts in `touching`. False when M(q) is not positive definite.
  bool prepare(const Vector& q, std::span<const int> touching);

  /// (1), (2). @param v  v- in, v+ out; @param Lambda_n  n_c, written for touching contacts only
  LcpStatus impact(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n);

  /// (3), (4) for the subset `candidates` of the touching contacts. @param lambda_n, gap_acceleration  n_c, written for
  /// candidates
  LcpStatus contact_forces(const Vector& q, const Vector& v, std::span<const int> candidates,
                           Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> gap_acceleration);

  /// J_n^i' v of a touching contact.
  double normal_velocity(int contact, const Eigen::Ref<const Vector>& v) const { return J_n_.col(contact).dot(v); }
  /// sum_k |J_n,k^i v_k|: what rounding of a normal velocity is measured against.
  double normal_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const {
    return J_n_.col(contact).cwiseAbs().dot(v.cwiseAbs());
  }

 private:
  void delassus(std::span<const int> contacts);

  const Problem& problem_;
  Counters& counters_;
  std::vector<int> touching_;
  Matrix M_, J_n_, MJ_, G_;  // J_n_, MJ_: n_q x n_c, the latter M^-1 J_n
  Eigen::LLT<Matrix> llt_;
  Vector packed_, f_, bias_, b_, z_;
  LemkeSolver lcp_;
};

}  // namespace ricochet
