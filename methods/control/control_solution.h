#pragma once

#include <string>
#include <vector>

#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/control_trajectory.h"
#include "problems/solution.h"

namespace ricochet {

/// Cost and violation after some iterations of a method.
struct ControlIterate {
  int iterations = 0;
  double cost = 0, violation = 0;
};

/// Solution of an optimal control problem, by whatever method.
struct ControlSolution {
  Status status = Status::success;       ///< success: stationary, see `stationarity`
  std::string message;                   ///< the reason, unless it succeeded
  ControlTrajectory trajectory;          ///< the last iterate; without points if the method has none that can be used
  double complementarity = 0;            ///< of a homotopy: max over the pairs of min(G, H)
  double violation = 0;                  ///< largest violation of a constraint
  std::string violated;                  ///< its name, empty for none
  std::string stationarity;              ///< what is known of the point: "S, B, 3 biactive pairs"
  bool is_b_stationary = false;          ///< known to be; for shooting possibly up to an edge (certificate.h)
  bool kept_branch = false;              ///< homotopy: solved on the branch of the solution before
  std::vector<HomotopyStep> steps;       ///< of a homotopy
  std::vector<ControlIterate> progress;  ///< before every iteration of shooting and at its end; after every relaxation
  int iterations = 0;
  long rollouts = 0;  ///< runs of the plant; 0 for a method that has none
  double seconds = 0, derivative_seconds = 0;

  bool succeeded() const { return status == Status::success; }
  /// Whether there are controls for the plant, stationary or not.
  bool has_plan() const { return !trajectory.points.empty(); }
};

}  // namespace ricochet
