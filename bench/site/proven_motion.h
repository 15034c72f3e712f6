#pragma once

#include <string>

#include "problems/problem.h"

namespace ricochet {

/// The proven motion of a scene (reference/certified) in HTML.
struct ProvenMotion {
  std::string summary;  ///< grade and digits, or the reason why there is no proof, in a line; empty without Arb
  std::string section;  ///< with the final state and all events; empty if the motion is open
};

/// @returns what is found within two seconds
ProvenMotion proven_motion(const Problem& problem);

}  // namespace ricochet
