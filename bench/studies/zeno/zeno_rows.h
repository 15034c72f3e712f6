#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/table.h"

namespace ricochet {

/// Motion of a closed element that starts with a normal velocity, computed and measured.
struct ZenoCapture {
  static constexpr const char* kKind = "zeno_capture";

  std::string tableau;  ///< "radau-iia:3"
  int n_s = 0;
  double kappa = 0, kept = 0;                    ///< methods/fesd/capture.h
  double measured_kappa = 0, measured_kept = 0;  ///< of single elements
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ZenoCapture, tableau, n_s, kappa, kept, measured_kappa, measured_kept)

/// A ball that comes to rest on the ground, by one method with one setting.
struct ZenoRun {
  static constexpr const char* kKind = "zeno_run";

  std::string method, command;
  double e = 0;          ///< restitution
  double H = 0;          ///< length of a step [s]; 0 for methods with a tolerance
  double tolerance = 0;  ///< of these
  std::string status, message;
  double t_Z = 0;  ///< exact [s]
  int impacts = 0;

  // Results of a successful run.
  bool rests = false;         ///< closed from the last impact on
  double t_rest = 0;          ///< of that impact [s]
  double v_plus = 0;          ///< after it [m/s]: stopped by stage forces unless zero
  double v_end = 0;           ///< size of the velocity at the end [m/s]
  double position_error = 0;  ///< largest after t_rest, between the steps, too [m]
  double rest_bound = 0;      ///< for t_Z - t_rest [s]; NaN where none is claimed
  double position_bound = 0;  ///< [m]; NaN where none is claimed
  double energy = 0;          ///< that vanished without an impact [J], per mass [m^2/s^2]

  bool succeeded() const { return status == "success"; }
  double rest_error() const { return t_Z - t_rest; }
  bool has_bound() const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ZenoRun, method, command, e, H, tolerance, status, message, t_Z,
                                                impacts, rests, t_rest, v_plus, v_end, position_error, rest_bound,
                                                position_bound, energy)

/// "radau-iia:3" of "fesd:radau-iia:3,elements=as_needed".
std::string tableau_of(const std::string& method);

/// One line per tableau.
Table zeno_capture_table(const std::vector<ZenoCapture>& captures);
/// One line per method: runs, failures, order of the rest time in H, largest error over bound.
Table zeno_table(const std::vector<ZenoRun>& runs);
/// Every run.
Table zeno_details(const std::vector<ZenoRun>& runs);

/// Error of the rest time over the step length with its bound, a panel per Radau IIA tableau, and kappa over the stages.
Chart zeno_chart(const std::vector<ZenoCapture>& captures, const std::vector<ZenoRun>& runs, const std::string& name);

}  // namespace ricochet
