#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "problems/solution.h"

namespace ricochet::reference {

/// Ends a run at time t [s]. @return false
inline bool stop(Solution& solution, Status status, double t, const std::string& message, FailureReason reason = {}) {
  solution.status = status;
  solution.message = fmt::format("t = {:.12g} s: {}", t, message);
  solution.reason = std::move(reason);
  return false;
}

}  // namespace ricochet::reference
