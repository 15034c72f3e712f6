#pragma once

#include <vector>

#include "reports/table.h"

namespace ricochet {

/// Which merit function can one trust? Exact solutions are drawn: impulses r and velocities w that fulfil the laws, open,
/// slip and stick by turns, make b = w - G r. They are disturbed by a known amount,
///
///   r' = r + delta ||r|| d,   w' = G r' + b                                                           (1)
///
/// d of length 1 in any direction, or the softest one of G, which moves velocities least. A merit value that can be
/// trusted says how far r', w' are from the solution, whatever the units, masses and numbers of contacts: its ratio to
/// the distance stays in a narrow band.
///
///   distance of velocities  max |w' - w| / max(|b|, |G_kk r_k|),   of impulses  ||r' - r|| / ||r||         (2)
///
/// Merit functions: violation() of contact_problem.h; the largest residual of contact_residuals.h, each relative to the
/// scales of velocity and impulse; FCLib's.
struct MeritStudy {
  Table values;  ///< medians by problem, direction and delta
  /// Smallest and largest merit, by problem and in all, over the distance of velocities, and over the larger of both.
  Table of_velocities, of_both;
};

/// @param draws  of each problem
MeritStudy run_merit_study(int draws);

}  // namespace ricochet
