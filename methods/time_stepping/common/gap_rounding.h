#pragma once

#include "problems/problem.h"

namespace ricochet {

/// Rounding error of a gap of zero, per contact [m]: a few roundings of the lengths that its terms have
/// in the motion,
///
///   64 eps |J_n^i|' (|q_0| + T |v_0| + T h |a_0|),   a_0 = M^-1 f(q_0, v_0),
///
/// so that no other body matters, and a body that rests at the origin has one, too: its velocity rounds as the velocity
/// h a_0 does that a step takes away again. @param h  of steps [s], or 0 for a state alone
Vector gap_rounding(const Problem& problem, double h);

}  // namespace ricochet
