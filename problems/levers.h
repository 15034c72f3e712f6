#pragma once

#include "problems/problem.h"

namespace ricochet {

/// Whether some friction element is bounded by the force of a contact: levers divide it (derivatives/rolling_friction.h).
inline bool has_levers(const ProblemInfo& info) {
  const auto first = info.contacts.size() - static_cast<std::size_t>(info.n_friction_elements);
  return info.n_friction_elements > 0 && !info.contacts[first].is_friction_element;
}

}  // namespace ricochet
