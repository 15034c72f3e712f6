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
  TimesMark times = TimesMark::unsaid;  ///< what is promised of the times
  bool force = false;                   ///< results that are there already are computed again
  double time_limit = 0;                ///< sets "time_limit", wall time per run [s]; 0: the experiment's own
  std::string data{};                   ///< sets "data", a folder of measured data; empty: the experiment's own
  std::vector<std::string> changes;     ///< "FIELD=VALUE" of the experiment; its results are then those of ID_part
  Selection selection;                  ///< part of its rows; the results are then those of ID_part, too
  int jobs = 1;                         ///< processes that make rows; results are the same
  Shard shard{};                        ///< of the rows only this part, into a file of its own
  std::string shards{};                 ///< folder of shards that have made the rows; empty: they are made here
};

/// @param text  of --times: exclusive or shared  @throws InputError for another one
TimesMark read_times_mark(const std::string& text);

/// An experiment that has no parts, as it is run: with its quick part or without, changes and selection; files that it
/// names have been found.
/// @throws InputError with file and field, or when nothing is selected
nlohmann::json experiment_document(const ExperimentFile& experiment, const RunOptions& options);

/// The experiments of which something is selected. @throws InputError for a pattern that fits none of them
std::vector<ExperimentFile> selected_parts(const std::vector<ExperimentFile>& parts, const RunOptions& options);

/// Runs an experiment that has no parts, by the study of its kind, and returns the path of its results file. Results of
/// the same experiment, with the same contents of the files it names, by the same program are taken as they are; an
/// interrupted run is continued. A line on standard error says so.
/// @throws InputError with file and field
std::string run_experiment(const ExperimentFile& experiment, const RunOptions& options);
/// @param name  of a file in bench/experiments/ without ".json", or a path
std::string run_experiment(const std::string& name, const RunOptions& options);

}  // namespace ricochet
