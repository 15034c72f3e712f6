#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "problems/solution.h"
#include "reference/ground_truth.h"

namespace ricochet {

/// A method on a case of a ground truth, and its largest errors: of the state, and of event times.
struct TruthCase {
  const char *id, *method;
  int steps;
  double state, times;
};

inline const reference::GroundTruth& truth_of(const std::vector<reference::GroundTruth>& cases, const std::string& id) {
  return *std::ranges::find(cases, id, &reference::GroundTruth::id);
}

/// What the ground truth states derivatives by.
inline std::vector<std::string> sensitivities_of(const reference::GroundTruth& truth) {
  std::vector<std::string> names;
  for (const auto& sensitivity : truth.sensitivities) names.push_back(sensitivity.wrt);
  return names;
}

/// Of the derivatives of the event times by sensitivities_of(), relative to 1 or their size.
inline double sensitivity_time_error(const Solution& s, const reference::GroundTruth& truth) {
  double worst = 0;
  for (std::size_t k = 0; k < truth.sensitivities.size(); ++k) {
    const Vector& expected = truth.sensitivities[k].dt_events;
    for (Eigen::Index event = 0; event < expected.size(); ++event) {
      const double dt = s.events[static_cast<std::size_t>(event)].dt[static_cast<Eigen::Index>(k)];
      worst = std::max(worst, std::abs(dt - expected[event]) / std::max(1.0, std::abs(expected[event])));
    }
  }
  return worst;
}

}  // namespace ricochet
