#pragma once

#include <vector>

#include "methods/time_freezing/regions.h"

namespace ricochet {

/// The state between two elements of a run.
struct RegionState {
  double t = 0;               ///< of the clock [s]
  Vector q, v;                ///< n_q
  Vector y;                   ///< n_c: depths of bounces [m]
  Regions regions;            ///< of the next element
  std::vector<int> touching;  ///< contacts that the system of the instant has
  bool is_free = true;        ///< no contact is held: free flight
};

}  // namespace ricochet
