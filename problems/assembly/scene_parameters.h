#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "problems/assembly/assembled_model.h"
#include "problems/assembly/assembled_problem.h"
#include "problems/names.h"
#include "problems/registry.h"
#include "problems/scene.h"

namespace ricochet {

/// Parameters of an assembled scene by name: the defaults, with changes of the user.
class SceneParameters {
 public:
  /// @throws InputError for an unknown name
  SceneParameters(const std::string& scene, std::vector<ParameterInfo> defaults, const ParameterChanges& changes)
      : parameters_(std::move(defaults)) {
    for (const auto& [name, value] : changes) {
      const auto at = std::ranges::find(parameters_, name, &ParameterInfo::name);
      if (at == parameters_.end()) {
        std::vector<std::string> known;
        for (const auto& parameter : parameters_) known.push_back(parameter.name);
        throw_unknown_name("parameter of " + scene, name, known);
      }
      at->value = value;
    }
  }

  double operator[](const std::string& name) const {
    return std::ranges::find(parameters_, name, &ParameterInfo::name)->value;
  }
  double value(const std::string& name) const { return (*this)[name]; }  ///< For what is no formula.
  /// @throws InputError when it is not a whole number from min to max
  int count(const std::string& name, int min, int max) const {
    const double value = (*this)[name];
    if (!(value >= min && value <= max && value == std::floor(value)))
      throw InputError("params." + name, value, fmt::format("a whole number from {} to {} is required", min, max));
    return static_cast<int>(value);
  }
  /// @throws InputError when it is not a finite number > 0
  double positive(const std::string& name) const {
    const double value = (*this)[name];
    if (!(value > 0) || !std::isfinite(value))
      throw InputError("params." + name, value, "a finite number > 0 is required");
    return value;
  }

  const std::vector<ParameterInfo>& list() const { return parameters_; }  ///< All, with their values.
  /// Position in list().
  std::ptrdiff_t index(const std::string& name) const {
    return std::ranges::find(parameters_, name, &ParameterInfo::name) - parameters_.begin();
  }

 private:
  std::vector<ParameterInfo> parameters_;
};

/// The same parameters as symbols, so that what is computed from them is a formula.
class ParameterSymbols {
 public:
  explicit ParameterSymbols(const SceneParameters& values) : values_(values), is_used_(values.list().size(), 0) {
    for (const auto& parameter : values.list()) symbols_.emplace_back(parameter.name);
  }

  GiNaC::ex operator[](const std::string& name) const {
    const auto k = static_cast<std::size_t>(values_.index(name));
    is_used_[k] = 1;
    return symbols_[k];
  }
  GiNaC::ex positive(const std::string& name) const { return (*this)[name]; }  ///< As numbers, they have been checked.
  double value(const std::string& name) const { return values_[name]; }        ///< Of a parameter outside formulas.
  int count(const std::string& name, int min, int max) const { return values_.count(name, min, max); }  ///< Likewise.

  /// Adds the parameters that formulas use to the `model`.
  void add_to(SymbolicModel& model) const {
    for (std::size_t k = 0; k < symbols_.size(); ++k) {
      if (!is_used_[k]) continue;
      model.parameters.push_back(values_.list()[k]);
      model.parameter_symbols.push_back(symbols_[k]);
    }
  }

 private:
  SceneParameters values_;
  std::vector<GiNaC::symbol> symbols_;
  mutable std::vector<char> is_used_;  ///< by operator[]
};

/// Parts and parameters of an assembled scene, in numbers or in formulas.
template <class T>
using AssemblyOf = std::conditional_t<std::is_same_v<T, double>, AssembledProblem, AssembledModel>;
/// See AssemblyOf.
template <class T>
using SceneParametersOf = std::conditional_t<std::is_same_v<T, double>, SceneParameters, ParameterSymbols>;

/// Registers an assembled scene, with its parameters; one of them is its `duration`. Call once, in the file of the
/// scene. As in scene.h, the scene is evaluated in two ways, with numbers for the Problem and with symbols for formulas:
///
///     template <class T>
///     struct BeadRow {
///       static constexpr SceneText text{"bead_row", "title", "source", "hard feature"};
///       static void assemble(AssemblyOf<T>& row, const SceneParametersOf<T>& p);   // adds the parts
///     };
///
/// @param file  file of the caller; std::source_location is missing in Clang before version 16
template <template <class> class Scene>
bool register_assembled_scene(const std::vector<ParameterInfo>& parameters, const char* file = __builtin_FILE()) {
  using GiNaC::ex;
  const SceneText text = Scene<double>::text;
  const auto make = [text, parameters](const ParameterChanges& changes) -> std::unique_ptr<Problem> {
    const SceneParameters numbers(text.id, parameters, changes);
    auto problem = std::make_unique<AssembledProblem>(text, numbers["duration"]);
    Scene<double>::assemble(*problem, numbers);
    problem->set_formulas([text, numbers] {
      const ParameterSymbols symbols(numbers);
      AssembledModel model(text, symbols["duration"]);
      Scene<ex>::assemble(model, symbols);
      SymbolicModel finished = model.finish();
      symbols.add_to(finished);
      return finished;
    });
    return problem;
  };
  return add_scene({text.id, text.title, text.source, text.hard_feature, make, parameters, file});
}

}  // namespace ricochet
