#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/rows/results_file.h"
#include "reports/section.h"

namespace ricochet {

/// Part of the results that contains CPU times, which simultaneous runs would spoil. The rows of all but the last are
/// made by ResultsFile::pieces() or sessions().
enum class Times {
  none,     ///< nowhere
  in_rows,  ///< in rows that say something else, too: where "times" of the experiment is false, they are NaN
  after,    ///< in rows after the pieces, of one session, which are left out where "times" is false
  always,   ///< in rows that say nothing without them
  session   ///< in all rows, which are made in one session, since that alone can compare them
};

/// A kind of experiment: how it is run, and what its results say. Everything of a kind is in its folder in
/// bench/studies/, and registers itself there; no list of studies exists anywhere else.
struct Study {
  std::string kind;     ///< "zeno": "kind" of the experiment files, and "study" of the results
  std::string summary;  ///< one line
  std::string fields;   ///< of its experiments: {"required": [...], "properties": {...}}; empty for one without files
  std::vector<std::string> rows;  ///< kinds of its rows; what results of before "study" are known by

  bool reads_quick = false;  ///< it reads "quick"; elsewhere --quick is the "quick_part" of the experiment

  Times times = Times::session;  ///< whether several processes may share the work

  /// Writes into an experiment that fits its fields the names of all methods that it runs, so that some can be selected
  /// (bench/experiment/selection.h). Empty where experiments name them all.
  std::function<void(nlohmann::json& experiment)> name_methods = {};

  /// Reads a file that another program has written. Empty where there is none; @return empty for what is no such file
  std::function<std::optional<Results>(const std::string& path, const std::string& text)> read_foreign = {};

  /// Makes the rows in a fixed order, each by ResultsFile::row(), rows(), pieces() or sessions().
  /// @param experiment  the file, with the changes of the command line: "quick", "times", "time_limit" and any field
  /// @throws InputError with the field, before the first row; nlohmann::json::exception for one that is missing
  std::function<void(const nlohmann::json& experiment, ResultsFile& file)> run;

  /// @throws InputError for damaged rows
  std::function<void(const Results& results, Section& section)> show;

  /// Message about an unexpectedly failed row, printed as soon as it is made; empty for other rows.
  std::function<std::string(const nlohmann::json& line)> failure = {};

  /// Number of rows that failed unexpectedly. Empty: every failure is expected.
  std::function<int(const Results& results)> unexpected_failures;
};

/// Study of an experiment file without "kind".
inline constexpr const char* kDefaultStudy = "method_grid";

/// Called once in the folder of each study.
bool register_study(Study study);

/// By name.
const std::vector<Study>& studies();

/// @throws InputError for an unknown kind, with the known ones
const Study& find_study(const std::string& kind);

/// The one that wrote the results. @throws InputError when their rows are of no study
const Study& study_of(const Results& results);

/// A results file, or a file that a study reads in place of one. @throws InputError
Results read_any_results(const std::string& path);

/// A results file with the section of its study. @throws InputError
ShownResults shown_results(const std::string& path);

/// Failed rows of results that were not expected to fail.
int unexpected_failures(const Results& results);

}  // namespace ricochet
