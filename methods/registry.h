#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "methods/method.h"
#include "methods/method_spec.h"

/// @file
/// The list of all methods: register_method(), make_method().

namespace ricochet {

/// An entry in the list of all methods: its name, usage and factory.
struct MethodEntry {
  std::string name;                   ///< before the first colon of a spec, lower_snake
  std::string usage;                  ///< "fesd:TABLEAU:STAGES[,n_fe=2][,elements=fixed|as_needed]"
  std::size_t max_arguments = 0;      ///< after the name: TABLEAU and STAGES
  std::string summary;                ///< one line
  std::vector<std::string> examples;  ///< specs that the conformance tests run on every scene
  int conformance_steps = 400;        ///< steps of these tests: fewer for methods whose steps are long
  std::string not_built{};            ///< of NotBuilt: why, for example "Siconos was not found"
  std::string scheme{};               ///< file with its equations, next to the registering file; empty: that file
  /// Makes the method of a spec: set by register_method(); empty: not built.
  std::function<std::unique_ptr<Method>(const MethodSpec&)> make{};
  std::string file{};  ///< source file as the compiler saw it; set by register_method()
};

/// In place of a method whose library was not found: it is listed, and cannot run.
struct NotBuilt;

/// Adds `entry` to the list; called by register_method(). Throws std::logic_error for a name that exists already.
/// @returns true, so that a constant of a file can be initialised by it
bool add_method(MethodEntry entry);

/// Registers a method under `entry`'s name. Called once in each method's own file; no list of methods exists anywhere
/// else.
/// @tparam T  a Method that a MethodSpec makes, or NotBuilt. It reads its options from the spec; unknown options, and
/// arguments beyond `max_arguments`, are rejected.
/// @param file  of the caller: std::source_location, which Clang has from 16 on only
template <class T>
bool register_method(MethodEntry entry, const char* file = __builtin_FILE()) {
  if constexpr (!std::is_same_v<T, NotBuilt>) {
    entry.make = [](const MethodSpec& spec) -> std::unique_ptr<Method> { return std::make_unique<T>(spec); };
  }
  entry.file = file;
  return add_method(std::move(entry));
}

/// All methods that are registered, by name.
std::vector<MethodEntry> methods();

/// Options that a built `method` reads: in its examples, and in the first of them with each choice of each option,
/// since some options are read only together with another one.
std::vector<MethodOption> options_of(const MethodEntry& method);

/// The method of a `spec`, "fesd:gauss:4,elements=as_needed".
/// @throws InputError for an unknown method (with the nearest names) or wrong arguments (with the usage)
std::unique_ptr<Method> make_method(const std::string& spec);

}  // namespace ricochet
