#pragma once

#include <memory>
#include <string>
#include <vector>

#include "methods/method.h"
#include "problems/problem.h"
#include "problems/registry.h"

namespace CLI {
class App;
}

namespace ricochet {

/// The parameters that `--set NAME=VALUE` changes; a value is a number or a formula of numbers. @throws InputError
ParameterChanges parameter_changes(const std::vector<std::string>& changes);

/// The options that choose a problem and a setting: --problem or --scene, --set, --steps or
/// --step-length, --tolerance, --time-limit; --allow-penetration, or --keep-penetration.
struct ProblemOptions {
  std::string problem, scene;
  std::vector<std::string> changes;
  std::string impact_law;  ///< in place of the one of the scene; empty: its own
  double depth = 0;        ///< [m] of penetration that is projected out of q0
  double kept_depth = 0;   ///< [m] of penetration that a run begins with
  int steps = 0;
  double step_length = 0;
  double tolerance = 0;
  double time_limit = 0;

  void add_problem(CLI::App& command);
  void add_settings(CLI::App& command);

  /// Says on stderr what it changed of the initial state. @throws InputError
  std::unique_ptr<Problem> make_problem() const;
  /// @throws InputError for a setting that the method does not take
  Settings settings(const Problem& problem, const Method& method) const;
  /// An option of add_settings() is on the command line: a zero that is given is not one by default.
  bool is_given(const std::string& option) const;

 private:
  const CLI::App* command_ = nullptr;
};

}  // namespace ricochet
