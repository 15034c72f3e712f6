#include "methods/method_spec.h"

#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

/// With options of each kind, and a tableau, as methods ask for them; not of files, which are the target `tableau`.
void method_spec(const std::string& text) {
  if (text.find('@') != std::string::npos) return;
  try {
    const MethodSpec spec(text);
    spec.number("theta", 0.5, 0, 1);
    spec.whole_number("n_fe", 2, 1, 100);
    spec.choice("elements", {"fixed", "as_needed"});
    spec.finish(2);
    tableau_argument(spec);
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
