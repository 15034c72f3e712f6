#pragma once

#include <vector>

#include "methods/islands/window_plan.h"
#include "methods/method.h"

namespace ricochet {

/// The run of one part of a scene in a window: its numbers are those of the part, its times count from the begin of the
/// window.
struct PartSolution {
  const WindowPlan::Part& members;
  const Solution& solution;
};

/// The modes of all contacts at the end of a window, n_c. Those that took no part are open.
std::vector<ContactMode> joined_modes(const ProblemInfo& info, const std::vector<PartSolution>& parts);

/// The runs of all parts in a window as one run of the whole, whose times count from the begin of the window. An event
/// has the state of the other parts at its time, without their own impacts at that time. Its samples and pieces of motion are those at the times of all parts. The status is success.
/// @param parts   together they have all coordinates
/// @param length  of the window [s]
/// @param recording  what to keep; from Recording::events on the parts need Recording::motion
Solution joined(const ProblemInfo& info, const std::vector<PartSolution>& parts, double length, Recording recording);

}  // namespace ricochet
