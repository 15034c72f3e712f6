#pragma once

#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet::reference {

/// A touching contact in the law below. Its rows of G and b are the normal, then its n_t tangents.
struct CoulombContact {
  int n_t = 0;       ///< 0, 1 or 2
  double mu = 0;     ///< > 0 exactly when n_t > 0
  Vector direction;  ///< n_t, unit slip direction, if it is known in advance; empty if the law determines it
};

/// z and u = G z + b, block after block: z_n, z_t and u_n, u_t of every contact.
struct CoulombSolution {
  std::vector<ContactMode> modes;  ///< by contact
  Vector z, u;
};

/// Unilateral contact with Coulomb friction at several contacts at once,
///
///   u = G z + b                                                                          (1)
///   0 <= u_n _|_ z_n >= 0                                                                (2)
///   ||z_t|| <= mu z_n,  and where u_t is not zero  z_t = -mu z_n u_t / ||u_t||           (3)
///
/// At an impact, z are impulses and u is (v_n+ + eps_r v_n-, v_t+). Between impacts, z are forces and u accelerations.
/// A contact that slips, or is about to, has a known direction d, and (3) becomes z_t = -mu z_n d for every u_t.
///
/// Every combination of modes is tried: open z = 0; stick u = 0; slip u_n = 0, z_t = -mu z_n d. Each gives a linear
/// system. Directions of slip in space are unknown angles, which Newton's method finds from u_t _|_ d_perp, starting
/// from a grid of angles.
/// A combination is accepted if the inequalities hold to rounding. Singular systems are skipped, because the solutions
/// at their edges belong to other combinations; without such solutions, the least one is taken.
/// @param b_size  sizes of the terms of which b is the sum, at least |b|: rounding errors do not cancel with b
/// @return all solutions that differ in z. None: inconsistent. Several: indeterminate, or redundant contacts.
/// Combinations with the same z count once, as the one with fewest active conditions: open before stick before slip.
/// @throws InputError for more than most_contacts()
std::vector<CoulombSolution> solve_coulomb_by_enumeration(const Matrix& G, const Vector& b, const Vector& b_size,
                                                          const std::vector<CoulombContact>& contacts);

/// Number of contacts that are enumerated within seconds. Directions of slip in space are searched as well.
constexpr std::size_t most_contacts(bool in_space) {
  return in_space ? 5 : 8;
}

}  // namespace ricochet::reference
