#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "bench/ensemble/ensemble.h"
#include "bench/rows/shard.h"

namespace ricochet {

/// The CSV of an ensemble, a line per run in the order of the runs, written as they come. While the work lasts it is
/// called FILE.partial, so that a file that looks complete is complete. Beside it FILE.json says what the ensemble is and
/// what program made it.
///
/// An interrupted ensemble is continued behind the last line that is whole; the result is the same, byte by byte.
class EnsembleFile {
 public:
  /// @param shard  of the runs, which are divided in their order: the files of all shards are, one behind the other and
  ///               without the headers of all but the first, that of the ensemble
  /// @throws InputError when the file cannot be written, or holds another ensemble or one of another program
  EnsembleFile(std::string path, const Ensemble& ensemble, const ProblemInfo& problem, Shard shard = {});

  bool is_complete() const { return is_complete_; }
  /// The runs that belong into the file: from this one
  std::int64_t begin() const { return begin_; }
  /// to before this one.
  std::int64_t end() const { return end_; }
  /// The first that is missing.
  std::int64_t n_done() const { return n_done_; }
  /// @param lines  of the runs up to `end`
  void append(std::int64_t end, const std::string& lines);
  /// Gives the file its name. @throws InputError
  void finish();

  /// How many of the runs in the file have ended how: {"success": 990, "infeasible": 10}.
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

/// Those of the shards of an ensemble in a folder, with the name of its file, of which all are there, in their order.
/// @throws InputError for the first that is missing, or of another ensemble or program
std::vector<std::string> complete_shards(const std::string& path, const std::string& folder, const Ensemble& ensemble);

/// Makes the file of an ensemble from those of its shards. @param header  csv_header()
/// @throws InputError for one that is damaged
void merge_shards(EnsembleFile& file, const std::vector<std::string>& shards, const std::string& header);

/// Runs what is missing of the runs of a file. @param file  the CSV  @param workers  one per thread
/// @param progress  called with the number of runs in the file
/// @returns how many runs were made here
std::int64_t run_ensemble(EnsembleFile& file, std::vector<std::unique_ptr<EnsembleWorker>>& workers,
                          const std::function<void(std::int64_t)>& progress);

}  // namespace ricochet
