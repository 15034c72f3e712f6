#pragma once

#include "problems/problem.h"

namespace ricochet {

/// Rounding error of a gap of zero, per contact [m]: a few roundings of the lengths that its terms have
/// in the motion,
///
///   64 eps |J_n^i|' (|q_0| + T |v_0| + T h |a_0|),   a_0 = M^-1 f(q_0, v_0),
///
/// so that other bodies have no influence. A body that rests at the origin has a rounding error, too: that of the
/// velocity h a_0, which a step adds and removes. @param h  of steps [s], or 0 for a state alone
Vector gap_rounding(const Problem& problem, double h);

}  // namespace ricochet
