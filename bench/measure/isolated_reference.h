#pragma once

#include "bench/measure/problem_choice.h"

namespace ricochet {

/// The reference of a problem, made in a process of its own, since it may find no end.
/// @param made  by choice.make_problem()
/// @throws std::runtime_error with the reason: it has no solution, or none within `seconds` of wall time
reference::Reference isolated_reference(const ProblemChoice& choice, const Problem& made, double seconds);

}  // namespace ricochet
