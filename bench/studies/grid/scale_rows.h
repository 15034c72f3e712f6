#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/growth.h"
#include "reports/table.h"

namespace ricochet {

/// Fixed steps of one method on a scene of some size.
struct ScaleRun {
  static constexpr const char* kKind = "scale_run";

  std::string scene;  ///< what a reader calls it: the problem, and which case of it
  std::string method;
  std::string command;  ///< reproduces the run
  int size = 0;         ///< the scene's parameter n
  int contacts = 0;     ///< possible ones
  int active = 0;       ///< that touch at the end
  int steps = 0;
  std::string status, message;

  // Of a run that succeeded.
  double step_seconds = 0;  ///< CPU time of a step, median; NaN where it is not measured
  double solves = 0;        ///< contact problems, or systems of a stage solver, per step
  double iterations = 0;    ///< inner iterations and pivots per step
  int events = 0;           ///< of the whole run

  bool succeeded() const { return status == "success"; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ScaleRun, scene, method, command, size, contacts, active, steps, status,
                                                message, step_seconds, solves, iterations, events)

/// One line per run; below those of a method on a scene, the growth exponents in the number of active contacts.
Table scale_table(const std::vector<ScaleRun>& runs);
/// Runs without a result, with the reason.
Table scale_failures(const std::vector<ScaleRun>& runs);
/// Time of a step over the number of active contacts, a panel per scene.
std::vector<GrowthCurve> scale_curves(const std::vector<ScaleRun>& runs);

}  // namespace ricochet
