#pragma once

#include "reference/certified/attempt.h"

/// @file
/// Motions of grade `computed`: numbers without a proof, to which two different runs agree.

namespace ricochet::reference::certified {

/// Replaces an open motion, in which impacts of coupled contacts accumulate or a gap touches zero, by a computed one.
/// Two runs take those velocities or that gap as zero: the first below 10^-c, c = digits + 10; the second below
/// 10^-(c + 20), with twice the bits. Their events must be the same, apart from the impacts that the first leaves out,
/// and the same contacts come to rest. Each number is that of the second run with the radius
///
///     |x_1 - x_2| + radius of x_1 + radius of x_2                                                                  (1)
///
/// If two runs do not agree, or one of them fails, the motion stays open and its reason states this.
void take_computed(CertifiedMotion& open, const Problem& problem, const Options& options, const TimeLimit& limit);

}  // namespace ricochet::reference::certified
