#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/table.h"

namespace ricochet {

/// What a closed element of a tableau does with a velocity across its contact, computed and measured.
struct ZenoCapture {
  std::string tableau;  ///< "radau-iia:3"
  int n_s = 0;
  double kappa = 0, kept = 0;                    ///< methods/fesd/capture.h
  double measured_kappa = 0, measured_kept = 0;  ///< of single elements
};

/// A ball that comes to rest on the ground, by one method with one setting.
struct ZenoRun {
  std::string method, command;
  double e = 0;          ///< restitution
  double H = 0;          ///< length of a step [s]; 0 for methods with a tolerance
  double tolerance = 0;  ///< of these
  std::string status, message;
  double t_Z = 0;  ///< exact [s]
  int impacts = 0;

  // Of a run that succeeded.
  bool rests = false;         ///< closed from the last impact on
  double t_rest = 0;          ///< of that impact [s]
  double v_plus = 0;          ///< behind it [m/s]: stopped by stage forces unless zero
  double v_end = 0;           ///< size of the velocity at the end [m/s]
  double position_error = 0;  ///< largest at a grid point behind t_rest [m]
  double rest_bound = 0;      ///< for t_Z - t_rest [s]; NaN where none is claimed
  double position_bound = 0;  ///< [m]; NaN where none is claimed
  double energy = 0;          ///< that vanished without an impact [J], per mass [m^2/s^2]

  bool succeeded() const { return status == "success"; }
  double rest_error() const { return t_Z - t_rest; }
  bool has_bound() const;
};

nlohmann::json to_json(const ZenoCapture& capture);
nlohmann::json to_json(const ZenoRun& run);
ZenoCapture zeno_capture_from_json(const nlohmann::json& j);
ZenoRun zeno_run_from_json(const nlohmann::json& j);

/// One line per tableau.
Table zeno_capture_table(const std::vector<ZenoCapture>& captures);
/// One line per method: runs, failures, order of the rest time in H, largest error over bound.
Table zeno_table(const std::vector<ZenoRun>& runs);
/// Every run.
Table zeno_details(const std::vector<ZenoRun>& runs);

}  // namespace ricochet
