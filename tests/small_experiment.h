#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "bench/experiment/run_experiment.h"
#include "reports/results.h"

namespace ricochet {

/// Rows of an experiment that a test writes: it is run in a folder of its own, which goes away with its files.
/// @param text  the JSON of the experiment file
inline Results run_small_experiment(const std::string& text, RunOptions options = {}) {
  namespace fs = std::filesystem;
  const struct Folder {
    const fs::path path = fs::temp_directory_path() / ("ricochet_small_" + std::to_string(getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
  } folder;
  const fs::path file = folder.path / "small.json";
  std::ofstream(file) << text;
  options.folder = (folder.path / "results").string();
  return read_results(run_experiment(file.string(), options));
}

}  // namespace ricochet
