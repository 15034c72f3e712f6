#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// A motion for a figure.
struct Trajectory {
  static constexpr const char* kKind = "trajectory";

  std::string problem, method;
  std::string setting;  ///< "500 steps", "tolerance 1e-09"
  std::vector<double> t;
  std::vector<std::vector<double>> q, v;  ///< per sample
  std::string picture;                    ///< SVG, the scene in motion; empty where the scene has no geometry
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Trajectory, problem, method, setting, t, q, v, picture)

/// The recorded motion as points that straight lines may join in a picture: the ends of every piece, both limits where
/// they differ, and points between them where the motion is curved. @param setting  of the run, in words
Trajectory trajectory_of(const Problem& problem, const std::string& method, const std::string& setting,
                         const Solution& solution);

/// The recorded motion at n + 1 equally spaced times and, with both limits, at its events, as CSV: a line "t,q[0],...,
/// v[0],..." and one per state, with the shortest texts that give the same numbers back. The clock is left out.
/// @throws InputError where no motion was recorded
std::string trajectory_csv(const Problem& problem, const Solution& solution, int n);

}  // namespace ricochet
