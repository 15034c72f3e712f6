#pragma once

#include "methods/method.h"
#include "problems/problem.h"

namespace ricochet {

/// A solution with dq, dv and Event::dt for settings.sensitivities: as the method computes them, or, when it computes
/// none (MethodInfo::has_sensitivities), by differences of its solution.
/// @throws InputError as Method::solve and with_value()
Solution solve_with_sensitivities(const Method& method, const Problem& problem, const Settings& settings);

/// The same by central differences of fourth order, for any method: four other problems a variable are made and solved.
/// When one of them fails, its status is that of the result. Event::dt is NaN where their events are not the same ones.
/// @param change  of a variable, relative to the larger of its size and 0.1 in its unit
Solution solve_with_differences(const Method& method, const Problem& problem, const Settings& settings, double change);

}  // namespace ricochet
