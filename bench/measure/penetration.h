#pragma once

#include "problems/motion.h"
#include "problems/problem.h"

namespace ricochet {

/// Deepest penetration of a unilateral contact at q [m]: the largest -g, 0 when all gaps are open.
double penetration(const Problem& problem, const Vector& q);

/// The deepest of a motion, at the ends of its pieces and at Chebyshev points between, since a step that begins and ends
/// outside of a contact may have been inside. Not below the sampled ones: between two of them it may be deeper by O(h^2)
/// of an eighth of a step.
double penetration(const Problem& problem, const Motion& motion);

}  // namespace ricochet
