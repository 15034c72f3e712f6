#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "methods/method.h"
#include "methods/method_spec.h"

namespace ricochet {

struct MethodEntry {
  std::string name;
  std::string usage;                  ///< "fesd:TABLEAU:STAGES[,n_fe=2][,elements=fixed|as_needed]"
  std::size_t max_arguments = 0;      ///< behind the name: TABLEAU and STAGES
  std::string summary;                ///< one line
  std::vector<std::string> examples;  ///< specs that the conformance tests run on every scene
  int conformance_steps = 400;        ///< that they take: fewer for methods whose steps are long
  std::string not_built{};            ///< of NotBuilt: why, for example "Siconos was not found"
  /// By register_method(); empty: not built.
  std::function<std::unique_ptr<Method>(const MethodSpec&)> make{};
};

/// In place of a method whose library was not found: it is listed, and cannot run.
struct NotBuilt;

bool add_method(MethodEntry entry);

/// Called once in each method's own file; no list of methods exists anywhere else.
/// @tparam T  a Method that a MethodSpec makes, or NotBuilt. It asks the spec for its options; options that it does not
/// know, and arguments beyond `max_arguments`, are refused for it.
template <class T>
bool register_method(MethodEntry entry) {
  if constexpr (!std::is_same_v<T, NotBuilt>) {
    entry.make = [](const MethodSpec& spec) -> std::unique_ptr<Method> { return std::make_unique<T>(spec); };
  }
  return add_method(std::move(entry));
}

std::vector<MethodEntry> methods();

/// What a built method asks its text for: in its examples, and in the first of them with each choice of each option,
/// since some options are asked for only beside another one.
std::vector<MethodOption> options_of(const MethodEntry& method);

/// @throws InputError for an unknown method (with the nearest names) or wrong arguments (with the usage)
std::unique_ptr<Method> make_method(const std::string& spec);

}  // namespace ricochet
