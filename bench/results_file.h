#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "reports/record.h"

namespace ricochet {

/// Results of one experiment, written line by line as they come. While the run lasts the file is called FILE.partial;
/// it gets its own name when the last line is written, so that a file that looks complete is complete. An interrupted
/// run is continued behind its last complete line. Results of another build or experiment text are kept under a dated
/// name.
class ResultsFile {
 public:
  /// @param header  with "key": equal keys mean that rows can be taken over
  /// @throws InputError when the folder cannot be written
  ResultsFile(const std::string& folder, const std::string& name, const nlohmann::json& header);

  const std::string& path() const { return path_; }
  /// Everything is there already: nothing to do.
  bool is_complete() const { return is_complete_; }
  /// The rows of an interrupted run, in order.
  const Results& taken_over() const { return taken_over_; }

  void append(const nlohmann::json& line);
  /// Writes the end line and gives the file its name.
  void finish();

 private:
  std::string path_, partial_;
  bool is_complete_ = false;
  Results taken_over_;
  std::ofstream file_;
};

}  // namespace ricochet
