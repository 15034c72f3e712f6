#include "reports/results_list.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "problems/input_error.h"

namespace ricochet {

namespace fs = std::filesystem;

void require_different(const std::vector<ShownResults>& list) {
  std::map<std::string, std::string> experiments, names;  // and the first file that has each
  for (const auto& shown : list) {
    const std::string& path = shown.results.path;
    const std::string experiment = shown.results.experiment(), name = fs::path(path).filename();
    if (const auto [first, is_new] = experiments.emplace(experiment, path); !is_new)
      throw InputError(
          "results file", path,
          fmt::format("{} also contains experiment {}; one file of each is allowed", first->second, experiment));
    if (const auto [first, is_new] = names.emplace(name, path); !is_new)
      throw InputError("results file", path,
                       fmt::format("{} has the same name; files with different names are required", first->second));
  }
}

void copy_results(const Results& results, const std::string& folder) {
  const fs::path to = fs::path(folder) / fs::path(results.path).filename();
  std::error_code error;
  if (fs::equivalent(results.path, to, error)) return;
  fs::copy_file(results.path, to, fs::copy_options::overwrite_existing, error);
  if (error) throw InputError("report file", to.string(), error.message());
}

}  // namespace ricochet
