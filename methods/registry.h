#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "methods/method.h"
#include "methods/method_spec.h"

namespace ricochet {

struct MethodEntry {
  std::string name;
  std::string usage;                  ///< "fesd:TABLEAU:STAGES[,n_fe=2][,elements=fixed|as_needed]"
  std::string summary;                ///< one line
  std::vector<std::string> examples;  ///< specs that the conformance tests run on every scene
  int conformance_steps = 400;        ///< that they take: fewer for methods whose steps are long
  std::function<std::unique_ptr<Method>(const MethodSpec&)> make;  ///< empty: not built
  std::string not_built;                                           ///< why, for example "Siconos was not found"
};

/// Called once in each method's own file; no list of methods exists anywhere else.
bool register_method(MethodEntry entry);

std::vector<MethodEntry> methods();

/// @throws InputError for an unknown method (with the nearest names) or wrong arguments (with the usage)
std::unique_ptr<Method> make_method(const std::string& spec);

}  // namespace ricochet
