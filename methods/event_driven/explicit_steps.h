#pragma once

#include <memory>
#include <string>
#include <vector>

#include "methods/event_driven/explicit_step.h"

namespace ricochet {

/// Names of the pairs of explicit_coefficients.h that steps are compiled for.
std::vector<std::string> explicit_pair_names();

/// @param pair  one of those. @throws InputError for an unknown one
std::unique_ptr<ExplicitStep> make_explicit_step(const std::string& pair, int n_q, ModeDynamics& dynamics);

/// "Dormand-Prince 5(4)", its source and its order.
struct ExplicitPairInfo {
  std::string name, source;
  int order = 0;
};
ExplicitPairInfo explicit_pair_info(const std::string& pair);

}  // namespace ricochet
