#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet::reference {

/// Indices of the forces of one contact in the unknowns of ForceEquations, and their law ||x_t|| <= mu x_n.
struct ForceCone {
  Eigen::Index normal = 0;  ///< the n_t tangential forces follow
  int n_t = 0;              ///< 0 if only x_n >= 0 is required: without friction, or slipping
  double mu = 0;
};

/// Distance of x from the edges of the cones: the least of mu x_n - ||x_t||, or of x_n. [N]
double slack(const Vector& x, const std::vector<ForceCone>& cones);

/// The division of forces among redundant contacts with the largest distance from the edges of their cones,
///
///   maximise m  over  x = least + N y,   m <= mu x_n - ||x_t||,  m <= x_n  for all cones   (1)
///
/// While m > 0, some division keeps the modes of the contacts; the modes end when m reaches 0. In the plane (1) is a
/// linear program, solved by trying all vertices; in space, cutting planes replace the cones. Unbounded forces, as of a
/// wedged rod, are limited by m = max |least|.
/// @param least  n, a solution; @param N  n x d, differences of solutions
/// @return `least` if it is well inside all cones, or if (1) is too large
Vector steadiest_division(const Vector& least, const Matrix& N, const std::vector<ForceCone>& cones);

}  // namespace ricochet::reference
