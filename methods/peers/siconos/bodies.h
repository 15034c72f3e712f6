#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet::siconos {

/// The coarsest needed split of the coordinates of a problem with constant M, f_q, f_v: no entry of them couples two
/// sets, and no contact touches more than two. Each set ascends, and the sets do by their first coordinate.
std::vector<std::vector<int>> coupled_coordinates(const ProblemInfo& info, const Matrix& M, const Matrix& f_q,
                                                  const Matrix& f_v);

}  // namespace ricochet::siconos
