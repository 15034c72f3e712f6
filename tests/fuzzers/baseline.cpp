#include "bench/gate/baseline.h"

#include "bench/gate/gate.h"
#include "problems/input_error.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

/// As a baseline, which is held against itself.
void baseline(const std::string& text) {
  try {
    const GridResults read = read_baseline(file_of(text));
    hold_against(read, read);
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
