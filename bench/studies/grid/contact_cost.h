#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/registry.h"
#include "reports/run.h"
#include "reports/table.h"

namespace ricochet {

// Study "contact_cost": the time of a step of a box in space per active contact. Field of the experiment: "methods".

/// A motion of the box of scene box_3d in which the same corners stay on the plane, and no other ones come.
struct BoxMotion {
  std::string name;        ///< what the corners do: "free", "slide", "stick", or "slide without friction"
  int closed = 0;          ///< corners on the plane: none, one, an edge or a face
  ParameterChanges scene;  ///< of box_3d
};

/// Each kind of contact with each number of corners.
std::vector<BoxMotion> box_motions();

/// Each method on each motion: Run::scene is the motion, its condition "closed" the number of corners on the plane. CPU
/// times are measured in random order.
/// @param methods  specs of fixed-step methods
std::vector<Run> measure_contact_cost(const std::vector<std::string>& methods, bool quick);

/// One line per method and kind of contact: times over the number of corners. The box flies in the first column; on a
/// face its forces are redundant.
Table contact_cost_table(const std::vector<Run>& costs);

}  // namespace ricochet
