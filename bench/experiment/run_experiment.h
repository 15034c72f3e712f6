#pragma once

#include <string>
#include <vector>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/selection.h"
#include "bench/rows/shard.h"
#include "reports/results.h"

namespace ricochet {

struct RunOptions {
  std::string folder = "out/results";
  bool quick = false;      ///< sets "quick" of the experiment: a part of its runs, times measured less often
  bool with_times = true;  ///< false: sets "times" to false
  TimesMark times = TimesMark::unspecified;  ///< state of the machine while times are measured
  bool force = false;                        ///< existing results are computed again
  double time_limit = 0;                     ///< sets "time_limit", wall time per run [s]; 0: the experiment's own
  std::string data{};                        ///< sets "data", a folder of measured data; empty: the experiment's own
  std::vector<std::string> changes;          ///< "FIELD=VALUE" of the experiment; its results are then those of ID_part
  Selection selection;                       ///< part of its rows; its results are then those of ID_part
  int jobs = 1;                              ///< number of processes; the results do not depend on it
  Shard shard{};                             ///< compute only this part of the rows, into its own file
  std::string shards{};                      ///< folder of shards to be merged; empty: rows are computed
};

/// @param text  of --times: exclusive or shared  @throws InputError for another one
TimesMark read_times_mark(const std::string& text);

/// The document of an experiment without parts as it is run: with or without its quick part, with changes and selection,
/// and with the paths of its files.
/// @throws InputError with file and field, or when nothing is selected
nlohmann::json experiment_document(const ExperimentFile& experiment, const RunOptions& options);

/// The experiments with selected rows. @throws InputError for a pattern that fits none of them
std::vector<ExperimentFile> selected_parts(const std::vector<ExperimentFile>& parts, const RunOptions& options);

/// Runs an experiment without parts by the study of its kind and returns the path of its results file. Existing results
/// of the same experiment, files and program are reused, and an interrupted run is continued; a line on standard error
/// reports this.
/// @throws InputError with file and field
std::string run_experiment(const ExperimentFile& experiment, const RunOptions& options);
/// @param name  of a file in bench/experiments/ without ".json", or a path
std::string run_experiment(const std::string& name, const RunOptions& options);

}  // namespace ricochet
