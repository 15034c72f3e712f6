#include "bench/study.h"

#include <fmt/format.h>

#include <map>

#include "bench/control_experiment.h"
#include "bench/control_growth.h"
#include "bench/environment.h"
#include "bench/experiment.h"
#include "bench/friction_ramp.h"
#include "bench/results_file.h"
#include "bench/zeno_study.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

const std::map<std::string, void (*)(const json&, ResultsFile&)>& studies() {
  static const std::map<std::string, void (*)(const json&, ResultsFile&)> kinds = {
      {"control_gradient", compare_gradients},
      {"control_growth", measure_growth},
      {"friction_ramp", study_friction_ramp},
      {"optimal_control", compare_transcriptions},
      {"zeno", study_zeno},
  };
  return kinds;
}

}  // namespace

std::string run_study(const std::string& name, const std::string& folder) {
  const auto [path, text] = read_experiment_text(name);
  try {
    const json document = json::parse(text);
    const auto study = studies().find(document.value("kind", ""));
    if (study == studies().end()) {
      std::string kinds;
      for (const auto& [kind, run] : studies()) kinds += (kinds.empty() ? "" : ", ") + kind;
      throw InputError(path + ": kind", document.value("kind", json()).dump(), "one of " + kinds + " is required");
    }
    ResultsFile file(folder, document.at("id"),
                     {{"kind", "header"},
                      {"schema", kResultsSchema},
                      {"experiment", document.at("id")},
                      {"title", document.at("title")},
                      {"description", document.at("description")},
                      {"command", "ricochet compare " + name},
                      {"environment", environment()},
                      {"key", hash_of(text + program_hash())}});
    if (file.is_complete()) return file.path();
    study->second(document, file);
    file.finish();
    return file.path();
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not an experiment: {}", path, error.what()));
  }
}

}  // namespace ricochet
