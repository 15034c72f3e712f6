#include "bench/ensemble/ensemble.h"

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "problems/input_error.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

/// An ensemble, up to what its first run would be given; it is not run.
void ensemble(const std::string& text) {
  try {
    nlohmann::json document = read_json_object(file_of(text), "an ensemble");
    resolve_paths(document, ensemble_schema(), "/nowhere");
    const Ensemble read = read_ensemble(document);
    read.values(0);
    read.values(read.n_runs() - 1);
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
