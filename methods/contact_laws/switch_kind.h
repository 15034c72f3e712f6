#pragma once

#include <cstdint>

namespace ricochet {

/// How a contact leaves its mode: which of its functions, positive in the mode, reaches zero. All methods that locate
/// switches use these kinds.
enum class SwitchKind : std::uint8_t {
  gap_closes,      ///< f_c = 0 of an open contact
  force_vanishes,  ///< lambda_n = 0 of a closed contact
  slip_stops,      ///< v_t = 0 of a slipping contact
  cone_reached,    ///< ||lambda_t|| = mu lambda_n of a sticking contact
  slip_turns,      ///< on a friction polygon, vertex slip becomes normal to an edge
  edge_left,       ///< on a friction polygon, the force reaches the end of its edge
};

}  // namespace ricochet
