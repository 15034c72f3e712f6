#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "problems/solution.h"
#include "reports/control_growth.h"
#include "reports/control_results.h"
#include "reports/fuzz_results.h"
#include "reports/hard_cases.h"
#include "reports/ramp_results.h"
#include "reports/scale_results.h"
#include "reports/seed_results.h"
#include "reports/zeno_results.h"

namespace ricochet {

/// CPU time of one solve() call over repeated measurements [s].
struct Timing {
  double median = 0, minimum = 0, lower_quartile = 0, upper_quartile = 0;
  int repetitions = 0;
};

/// One run of one method with one setting: one row of a results file, complete in itself.
struct Record {
  std::string experiment, problem;
  std::string method;  ///< as on the command line
  std::string title;
  int steps = 0;         ///< N_sim, fixed-step methods
  double tolerance = 0;  ///< error-controlled methods
  double h_bar = 0;      ///< mean length of a Runge-Kutta step, T / elements [s]
  double nominal_order = 0;
  std::string status;  ///< to_string(Status)
  std::string message;
  double error = 0;            ///< max-norm of the error of the final (q, v); NaN when the run failed
  double reference_error = 0;  ///< bound for the error of the reference
  double solution_size = 0;    ///< max-norm of the reference's final (q, v)
  /// Where there are some, `error` is that of d(q, v) with respect to these (reference::sensitivity_difference), and
  /// `solution_size` is 1.
  std::vector<std::string> sensitivities;
  double max_residual = -1;  ///< -1: not audited
  int detected_events = 0;
  Counters counters;
  std::optional<Timing> timing;
  std::string instead_of;  ///< method whose failure at this setting this run answers; empty otherwise
  std::string command;     ///< reproduces the run

  bool succeeded() const { return status == "success"; }
  bool has_error() const;  ///< succeeded, and was compared with a reference
  /// "200" or "1e-08": the setting that distinguishes runs of one method.
  std::string setting() const;
};

/// A motion for a figure.
struct Trajectory {
  std::string problem, method;
  std::vector<double> t;
  std::vector<std::vector<double>> q, v;  ///< per sample
};

/// What the errors of results are errors of, in words.
struct ErrorMeasure {
  std::string axis;        ///< of a figure
  std::string definition;  ///< a sentence
};

/// A results file, read.
struct Results {
  nlohmann::json header;
  std::vector<Record> records;
  std::vector<Trajectory> trajectories;
  std::vector<ControlRun> control_runs;
  std::vector<ControlGradient> gradients;
  std::vector<ControlGrowth> growth;
  std::vector<SeedRun> seed_runs;
  std::vector<ScaleRun> scale_runs;
  std::vector<ZenoCapture> zeno_captures;
  std::vector<ZenoRun> zeno_runs;
  std::vector<RampGrid> ramps;
  std::vector<RampFacets> ramp_facets;
  std::vector<HardCell> hard_cells;
  std::vector<FuzzScene> fuzz_scenes;
  bool is_complete = false;

  std::string experiment() const { return header.value("experiment", ""); }
  bool has_errors() const;   ///< some run was compared with a reference
  bool has_timings() const;  ///< some run was timed
  ErrorMeasure error_measure() const;
  /// Methods in the order of their first record.
  std::vector<std::string> methods() const;
  /// Records of a method, by decreasing accuracy demand last: ascending steps, descending tolerance. Without
  /// replacements.
  std::vector<const Record*> of(const std::string& method) const;
};

constexpr int kResultsSchema = 1;

nlohmann::json to_json(const Record& record);
nlohmann::json to_json(const Timing& timing);
nlohmann::json to_json(const Trajectory& trajectory);

/// Reads a results file (JSON lines: header, rows, timings, end).
/// @throws InputError when it cannot be read, is damaged, or has another schema
Results read_results(const std::string& path);

}  // namespace ricochet
