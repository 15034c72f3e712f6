#pragma once

#include <fmt/format.h>

#include <algorithm>

#include "methods/method.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/dense_solve.h"

namespace ricochet {

/// Whether elements can hold the bilateral constraints of a problem: a singular A does not determine their forces,
/// and without a stage at the right end q_1 violates curved ones.
inline Support can_hold_bilateral(const ButcherTableau& tableau, const ProblemInfo& problem) {
  if (!problem.has_bilateral()) return Support::yes();
  if (!is_invertible(tableau.A)) {
    return Support::no(
        fmt::format("the matrix A of tableau {} is singular and does not determine the forces of bilateral constraints",
                    tableau.name));
  }
  const auto is_curved = [&](int i) { return !problem.contacts[i].is_affine; };
  const auto curved = std::find_if(problem.bilateral.begin(), problem.bilateral.end(), is_curved);
  if (curved == problem.bilateral.end() || tableau.is_stiffly_accurate()) return Support::yes();
  return Support::no(fmt::format(
      "tableau {} has no stage at the right end; the curved bilateral constraint '{}' needs a stiffly accurate tableau",
      tableau.name, problem.contacts[*curved].name));
}

}  // namespace ricochet
