#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "bench/ensemble/ensemble.h"
#include "bench/rows/shard.h"

namespace ricochet {

/// The CSV of an ensemble, with a line per run in the order of the runs. During the work it is called FILE.partial, so
/// that a file without this suffix is complete. FILE.json beside it describes the ensemble and the program that made
/// it.
///
/// An interrupted ensemble is continued after the last complete line; the result is the same, byte by byte.
class EnsembleFile {
 public:
  /// @param shard  part of the runs, in their order; the concatenated files of all shards, with the header of the first
  ///               only, are the file of the ensemble
  /// @throws InputError if the file cannot be written, or contains another ensemble or one of another program
  EnsembleFile(std::string path, const Ensemble& ensemble, const ProblemInfo& problem, Shard shard = {});

  bool is_complete() const { return is_complete_; }
  /// First run in the file.
  std::int64_t begin() const { return begin_; }
  /// End of the runs in the file (excluded).
  std::int64_t end() const { return end_; }
  /// First missing run.
  std::int64_t n_done() const { return n_done_; }
  /// @param lines  of the runs up to `end`
  void append(std::int64_t end, const std::string& lines);
  /// Renames the complete file. @throws InputError
  void finish();

  /// Number of runs in the file by status: {"success": 990, "infeasible": 10}.
  std::map<std::string, std::int64_t> endings() const;

 private:
  void write_header(const std::string& header, const nlohmann::json& description);
  void take_lines(const std::string& header);

  std::string path_, partial_;
  std::size_t status_column_;
  std::int64_t begin_, end_, n_done_;
  bool is_complete_ = false;
  std::ofstream file_;
};

/// Finds a complete set of shards of an ensemble in a folder, by the name of its file. @return their paths, in order
/// @throws InputError for the first shard that is missing, or of another ensemble or program
std::vector<std::string> complete_shards(const std::string& path, const std::string& folder, const Ensemble& ensemble);

/// Makes the file of an ensemble from its shards. @param header  csv_header()
/// @throws InputError for a damaged shard
void merge_shards(EnsembleFile& file, const std::vector<std::string>& shards, const std::string& header);

/// Computes the missing runs of a file. @param file  the CSV  @param workers  one per thread
/// @param progress  called with the number of runs in the file
/// @returns the number of computed runs
std::int64_t run_ensemble(EnsembleFile& file, std::vector<std::unique_ptr<EnsembleWorker>>& workers,
                          const std::function<void(std::int64_t)>& progress);

}  // namespace ricochet
