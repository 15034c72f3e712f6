#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "problems/input_error.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

/// An experiment, up to what its study would be given; it is not run.
void experiment(const std::string& text) {
  try {
    ExperimentFile file = read_experiment_file(file_of(text));
    file.parts();
    const Study& study = find_study(file.kind());
    for (const bool quick : {true, false}) {
      ExperimentFile chosen = file;
      chosen.take_quick_part(quick);
      experiment_schema(study).check(chosen.document, "experiment: ");
      resolve_paths(chosen.document, experiment_schema(study), "/nowhere");
    }
    file.change("steps=[1, 2]");
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
