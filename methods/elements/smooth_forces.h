#pragma once

#include "methods/method.h"

namespace ricochet {

/// Whether an element, whose motion is a polynomial, can follow the forces of a problem: no switch is located where a
/// force jumps.
inline Support can_follow_forces(const ProblemInfo& problem) {
  if (!problem.structure.force_jumps) return Support::yes();
  return Support::no("a force jumps with `if` or `sign`, and discontinuities of forces are not located yet");
}

}  // namespace ricochet
