#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/measure/trajectory_of.h"
#include "reports/results.h"
#include "reports/run.h"
#include "reports/timing.h"

namespace ricochet {

/// The time of a run, by the number of its record; all of them are measured in one session.
struct TimingRow {
  static constexpr const char* kKind = "timing";

  std::size_t row = 0;
  Timing timing;
  double peak_bytes = Metrics::kNone;  ///< of the heap, above what was taken before; none of a run in another process
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(TimingRow, row, timing, peak_bytes)

/// Names of the quantity whose error is measured.
struct ErrorMeasure {
  std::string axis;        ///< of a figure
  std::string definition;  ///< a sentence
};

/// The line after the header, counted from 1.
constexpr int kFirstRowLine = 2;

/// Results of methods on a grid of settings.
struct GridResults {
  GridResults() = default;
  /// @throws InputError for a damaged row, or a timing of none
  explicit GridResults(const Results& results);

  std::string path;  ///< of the file
  std::string id, title;
  std::map<std::string, std::string> overhead_of;  ///< method -> method its cost is compared with
  std::vector<Run> records;
  std::map<std::size_t, Timing> timings;     ///< by record
  std::map<std::size_t, double> peak_bytes;  ///< the same, of TimingRow
  std::vector<Trajectory> trajectories;
  bool is_complete = false;
  bool is_quick = false;  ///< the short part of the experiment

  bool has_errors() const;   ///< some run was compared with a reference
  bool has_metrics() const;  ///< the motion of some run was looked at
  ErrorMeasure error_measure() const;
  /// Methods in the order of their first record.
  std::vector<std::string> methods() const;
  /// Records of a method, as runs_of().
  std::vector<const Run*> of(const std::string& method) const { return runs_of(records, method); }
  /// Null for a run that was not timed. @param record  one of `records`
  const Timing* timing_of(const Run& record) const;
  /// NaN where it was not measured. @param record  one of `records`
  double peak_bytes_of(const Run& record) const;
  /// Its line in the file, in which records are the first rows. @param record  one of `records`
  int line_of(const Run& record) const { return static_cast<int>(&record - records.data()) + kFirstRowLine; }
};

}  // namespace ricochet
