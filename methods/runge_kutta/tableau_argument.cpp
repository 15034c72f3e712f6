#include "methods/runge_kutta/tableau_argument.h"

#include <charconv>

#include "problems/input_error.h"

namespace ricochet {

namespace {

ButcherTableau tableau_of(const std::vector<std::string>& arguments, const std::string& text) {
  if (!arguments.empty() && arguments[0].starts_with('@')) {
    if (arguments.size() > 1) throw InputError("argument", arguments[1], "nothing may follow a tableau file");
    return read_tableau_file(arguments[0].substr(1));
  }
  if (arguments.size() < 2)
    throw InputError("tableau", text, "a tableau and its number of stages are required, for example radau-iia:3");
  int n_s = 0;
  const std::string& stages = arguments[1];
  const auto [end, error] = std::from_chars(stages.data(), stages.data() + stages.size(), n_s);
  if (error != std::errc() || end != stages.data() + stages.size())
    throw InputError("stages", stages, "a whole number is required");
  return make_tableau(arguments[0], n_s);
}

}  // namespace

ButcherTableau tableau_argument(const MethodSpec& spec) {
  return tableau_of(spec.arguments(), spec.text());
}

ButcherTableau tableau_argument(const std::string& text) {
  if (text.starts_with('@')) return tableau_of({text}, text);
  const auto colon = text.find(':');
  if (colon == std::string::npos) return tableau_of({text}, text);
  return tableau_of({text.substr(0, colon), text.substr(colon + 1)}, text);
}

}  // namespace ricochet
