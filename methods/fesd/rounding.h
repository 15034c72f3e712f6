#pragma once

#include <limits>

namespace ricochet {

// What counts as zero in a FESD-J step, relative to the terms that cancel.

/// A gap: a few dozen additions of numbers of the size of q.
constexpr double kGapRounding = 64 * std::numeric_limits<double>::epsilon();
/// A gap that its equation holds at zero may have gathered rounding over many steps (StageSolver removes it from 1e-13
/// on).
constexpr double kClosedGapRounding = 2e-13;
/// A velocity at the left end of an element.
constexpr double kVelocityRounding = 64 * std::numeric_limits<double>::epsilon();
/// Forces, and slip velocities inside an element, carry the rounding of the stage equations.
constexpr double kForceRounding = 1e-12;
constexpr double kSlipRounding = 1e-12;

}  // namespace ricochet
