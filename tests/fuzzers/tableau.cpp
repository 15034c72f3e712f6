#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "problems/input_error.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

void tableau(const std::string& text) {
  const std::string path = file_of(text);
  try {
    read_tableau_file(path);
  } catch (const InputError&) {
  }
  try {
    read_embedded_tableau(path);
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
