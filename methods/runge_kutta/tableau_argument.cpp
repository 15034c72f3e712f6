#include "methods/runge_kutta/tableau_argument.h"

#include <charconv>

#include "problems/input_error.h"

namespace ricochet {

ButcherTableau tableau_argument(const MethodSpec& spec) {
  const auto& arguments = spec.arguments();
  if (!arguments.empty() && arguments[0].starts_with('@')) {
    if (arguments.size() > 1) throw InputError("argument", arguments[1], "nothing may follow a tableau file");
    return read_tableau_file(arguments[0].substr(1));
  }
  if (arguments.size() < 2)
    throw InputError("tableau", spec.text(),
                     "a tableau and its number of stages are required, for example radau-iia:3");
  int n_s = 0;
  const std::string& stages = arguments[1];
  const auto [end, error] = std::from_chars(stages.data(), stages.data() + stages.size(), n_s);
  if (error != std::errc() || end != stages.data() + stages.size())
    throw InputError("stages", stages, "a whole number is required");
  return make_tableau(arguments[0], n_s);
}

}  // namespace ricochet
