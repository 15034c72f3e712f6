#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/registry.h"
#include "reports/table.h"

namespace ricochet {

/// A motion of the box of scene box_3d in which the same corners stay on the plane, and no other ones come.
struct BoxMotion {
  std::string name;        ///< what the corners do: "free", "slide", "stick", or "slide without friction"
  int closed = 0;          ///< corners on the plane: none, one, an edge or a face
  ParameterChanges scene;  ///< of box_3d
};

/// Each kind of contact with each number of corners.
std::vector<BoxMotion> box_motions();

/// Time of a step over the number of active contacts, by benchmark: all motions and methods in random order. The box
/// flies in the first column; on a face its forces are redundant.
/// @param methods  specs of fixed-step methods
/// @throws std::runtime_error when a method fails, or ends with other corners on the plane
Table contact_cost(const std::vector<std::string>& methods, bool quick);

}  // namespace ricochet
