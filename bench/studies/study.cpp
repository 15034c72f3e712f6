#include "bench/studies/study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bench/environment.h"
#include "bench/experiment.h"
#include "bench/results_file.h"
#include "bench/studies/control_experiment.h"
#include "bench/studies/control_growth.h"
#include "bench/studies/control_seeds.h"
#include "bench/studies/friction_ramp.h"
#include "bench/studies/scale.h"
#include "bench/studies/zeno_study.h"
#include "problems/input_error.h"
#include "problems/named_values.h"

namespace ricochet {
namespace {

using nlohmann::json;

using Study = void (*)(const json&, ResultsFile&);

const Names<Study>& studies() {
  static const Names<Study> kinds = {
      {"optimal_control", compare_transcriptions},
      {"control_gradient", compare_gradients},
      {"control_growth", measure_growth},
      {"control_seeds", study_seeds},
      {"friction_ramp", study_friction_ramp},
      {"scale", study_scale},
      {"zeno", study_zeno},
  };
  return kinds;
}

}  // namespace

std::string run_study(const std::string& name, const std::string& folder) {
  const auto [path, text] = read_experiment_text(name);
  try {
    const json document = json::parse(text);
    const Study* study = find(studies(), document.value("kind", ""));
    if (!study)
      throw InputError(path + ": kind", document.value("kind", json()).dump(),
                       fmt::format("one of {} is required", fmt::join(list(studies()), ", ")));
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
    (*study)(document, file);
    file.finish();
    return file.path();
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not an experiment: {}", path, error.what()));
  }
}

}  // namespace ricochet
