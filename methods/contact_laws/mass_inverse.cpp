#include "methods/contact_laws/mass_inverse.h"

namespace ricochet {

MassInverse::MassInverse(const Problem& problem, Counters& counters)
    : problem_(problem), structure_(problem.info().structure), counters_(counters), M_(problem.n_q(), problem.n_q()) {
  DisjointSets sets(problem.n_q());
  if (!structure_.diagonal_mass) sets.join(structure_.couplings);
  if (problem.info().has_bilateral()) sets.join_all();
  islands_.assign(sets);
  if (structure_.constant_mass) factorize(problem.info().q0);
}

bool MassInverse::factorize(const Vector& q) {
  problem_.mass_matrix(q.data(), M_.data());
  ++counters_.mass_factorizations;
  if (structure_.diagonal_mass) return (M_.diagonal().array() > 0).all();
  llt_.compute(M_);
  return llt_.info() == Eigen::Success;
}

bool MassInverse::set_position(const Vector& q) {
  return structure_.constant_mass || factorize(q);
}

void MassInverse::solve_in_place(Eigen::Ref<Vector> x) const {
  ++counters_.linear_solves;
  if (structure_.diagonal_mass)
    x.array() /= M_.diagonal().array();
  else
    llt_.solveInPlace(x);
}

void MassInverse::apply(const Vector& x, Vector& y) const {
  y = x;
  solve_in_place(y);
}

void MassInverse::apply(std::span<const int> islands, const Vector& x, Vector& y) const {
  if (!structure_.diagonal_mass) return apply(x, y);
  ++counters_.linear_solves;
  for (const int island : islands) {
    for (const int k : islands_.members(island)) y[k] = x[k] / M_(k, k);
  }
}

}  // namespace ricochet
