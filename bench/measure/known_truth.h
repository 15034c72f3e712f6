#pragma once

#include "bench/measure/problem_choice.h"

namespace ricochet {

/// Looks for a certified solution of the problem with its parameters: of the file and the case that the problem is from,
/// or the one that an experiment of bench/experiments/ compares it with. Without one the choice stays as it is, and its
/// reference is computed.
void find_ground_truth(ProblemChoice& choice);

}  // namespace ricochet
