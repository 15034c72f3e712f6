#pragma once

#include <fmt/format.h>

#include <string>

#include "problems/solution.h"

namespace ricochet::reference {

/// Ends a run at time t [s] with a reason. @return false
inline bool stop(Solution& solution, Status status, double t, const std::string& reason) {
  solution.status = status;
  solution.message = fmt::format("t = {:.12g} s: {}", t, reason);
  return false;
}

}  // namespace ricochet::reference
