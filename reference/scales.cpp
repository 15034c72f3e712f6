#include "reference/scales.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/disjoint_sets.h"

namespace ricochet::reference {

Scales::Scales(const Problem& problem, double tau) : tau_(tau) {
  const auto& info = problem.info();
  DisjointSets groups(info.n_q);
  groups.join(info.structure.couplings);
  for (const auto& contact : info.contacts) groups.join(contact.pushed());

  const Matrix M = problem.mass_matrix(info.q0);
  const CholeskyFactors factors(M);
  const Vector w = info.v0.cwiseAbs() + tau_ * factors.solve(problem.force(info.q0, info.v0)).cwiseAbs();
  const auto sizes_of = [&](const auto& is_member) {  // (2), of the coordinates that is_member chooses
    double twice_energy = 0, fastest = 0;
    for (int l = 0; l < info.n_q; ++l) {
      if (!is_member(l)) continue;
      twice_energy += M(l, l) * w[l] * w[l];
      fastest = std::max(fastest, w[l]);
    }
    return [=](double mass) { return std::min(std::sqrt(twice_energy / mass), fastest); };
  };
  const auto whole = sizes_of([&](int l) { return l != info.clock; });
  V_.resize(info.n_q);
  for (int k = 0; k < info.n_q; ++k) {
    const auto group = sizes_of([&](int l) { return groups.of(l) == groups.of(k); });
    V_[k] = group(M(k, k)) > 0 ? group(M(k, k)) : whole(M(k, k)) > 0 ? whole(M(k, k)) : 1;
  }
  Q_ = tau_ * V_;  // (3)
  const Matrix J = problem.normal_jacobian(info.q0);
  P_ = (J.cwiseAbs().transpose() * V_).array() /
       J.cwiseProduct(factors.solve_columns(problem.force_directions(J))).colwise().sum().transpose().array();  // (4)
  F_ = P_ / tau_;                                                                                               // (4)
}

}  // namespace ricochet::reference
