#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet::reference {

/// Where the forces of one contact stand among the unknowns of ForceEquations, and their law ||x_t|| <= mu x_n.
struct ForceCone {
  Eigen::Index normal = 0;  ///< the n_t tangential forces follow
  int n_t = 0;              ///< 0 where only x_n >= 0 is asked: without friction, or slipping
  double mu = 0;
};

/// How far x is inside all cones: the least of mu x_n - ||x_t||, or of x_n. [N]
double slack(const Vector& x, const std::vector<ForceCone>& cones);

/// The division of forces among redundant contacts that is farthest inside their cones,
///
///   maximise m  over  x = least + N y,   m <= mu x_n - ||x_t||,  m <= x_n  for all cones   (1)
///
/// While m > 0 some division keeps the modes of the contacts, and with m they end: no other division tells as much. In
/// the plane (1) is a linear program, solved by trying all vertices; in space cutting planes replace the cones. Forces
/// that may grow without bound, as of a rod that is wedged, stop at m = max |least|.
/// @param least  n, a solution; @param N  n x d, differences of solutions
/// @return `least` where that is well inside all cones, or (1) too large to try
Vector steadiest_division(const Vector& least, const Matrix& N, const std::vector<ForceCone>& cones);

}  // namespace ricochet::reference
