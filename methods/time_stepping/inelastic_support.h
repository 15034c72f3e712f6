#pragma once

#include <algorithm>

#include "methods/method.h"

namespace ricochet {

/// Of the methods without an impact law: contacts that close stay closed.
inline Support only_inelastic(const ProblemInfo& problem) {
  const bool bounces = std::ranges::any_of(problem.contacts, [](const auto& contact) { return contact.eps_r > 0; });
  return bounces ? Support::no("it has no restitution, eps_r = 0 is required in every contact") : Support::yes();
}

}  // namespace ricochet
