#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// Region of the state, as divided by the switching functions of one contact:
enum class Region : std::uint8_t {
  free,     ///< f_c > 0, or J_n' v > 0: the contact leaves the dynamics alone
  sliding,  ///< on the surface J_n' v = 0 between `free` and `pushed`: persistent contact
  pushed,   ///< f_c <= 0, J_n' v < 0: a constant force stops the approach while time is frozen
  bouncing  ///< f_c <= 0 with restitution: a spring and a damper return it while time is frozen
};

struct ContactRegion {
  Region region = Region::free;
  bool sticks = false;                    ///< and on the surface J_t' v = 0, too
  bool turns = false;                     ///< slips in space along J_t' v, which turns
  std::array<double, 2> direction{0, 0};  ///< of slip; where it turns, that at the left end
  bool is_held() const { return region != Region::free; }
  bool slips() const { return is_held() && !sticks && (direction[0] != 0 || direction[1] != 0); }
};

/// The regions of all contacts, constant within an element. Bilateral constraints slide always.
struct Regions {
  bool is_frozen = false;  ///< some contact is pushed or bounces
  std::vector<ContactRegion> of;
};

/// The auxiliary dynamics of the contacts, by which time freezing replaces impacts.
struct AuxiliaryDynamics {
  Vector push;     ///< n_c [N], force of the full push
  double k = 0;    ///< [1/s^2] of a bounce
  Vector damping;  ///< n_c [1/s], c of a bounce

  /// @param a_n  gap acceleration of a push at the start of the run [m/s^2]
  /// @param bounce  pseudo time of a bounce without damping [s]
  AuxiliaryDynamics(const Problem& problem, double a_n, double bounce);
};

}  // namespace ricochet
