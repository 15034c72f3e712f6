#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

void scene(const std::string& text) {
  try {
    const auto problem = read_scene_text(text, "scene");
    problem->gap(problem->info().q0);
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
