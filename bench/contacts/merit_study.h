#pragma once

#include <vector>

#include "reports/table.h"

namespace ricochet {

/// Compares merit functions with true distances from a solution. Exact solutions are drawn: impulses r and velocities w
/// that satisfy the laws, open, slip and stick in turn, define b = w - G r. They are perturbed by a known amount,
///
///   r' = r + delta ||r|| d,   w' = G r' + b                                                           (1)
///
/// where d has length 1 and a random direction, or the direction in which G changes velocities least. A reliable merit
/// value measures the distance of r', w' from the solution for all units, masses and numbers of contacts: its ratio to
/// the distance stays in a narrow band.
///
///   distance of velocities  max |w' - w| / max(|b|, |G_kk r_k|),   of impulses  ||r' - r|| / ||r||         (2)
///
/// Merit functions: violation() of contact_problem.h; the largest residual of contact_residuals.h, each relative to the
/// scales of velocity and impulse; FCLib's.
struct MeritStudy {
  Table values;  ///< medians by problem, direction and delta
  /// Smallest and largest merit, per problem and in total, over the distance of velocities, and over the larger
  /// distance.
  Table of_velocities, of_both;
};

/// @param draws  of each problem
MeritStudy run_merit_study(int draws);

}  // namespace ricochet
