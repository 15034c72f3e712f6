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

/// The options that choose a problem and a setting: --problem or --scene, --set, --until, --steps or
/// --step-length, --tolerance, --time-limit; --allow-penetration, or --keep-penetration.
struct ProblemOptions {
  std::string problem, scene;
  std::vector<std::string> changes;
  std::string until;       ///< formula at whose zero runs end; empty: that of the scene
  std::string impact_law;  ///< replaces that of the scene; empty: not replaced
  double depth = 0;        ///< largest penetration that is removed from q0 [m]
  double kept_depth = 0;   ///< largest initial penetration that is kept [m]
  int steps = 0;
  double step_length = 0;
  double tolerance = 0;
  double time_limit = 0;

  void add_problem(CLI::App& command);
  void add_settings(CLI::App& command);

  /// Prints a change of the initial state to stderr. @throws InputError
  std::unique_ptr<Problem> make_problem() const;
  /// @throws InputError for a setting that the method does not take
  Settings settings(const Problem& problem, const Method& method) const;
  /// Whether an option of add_settings() is on the command line.
  bool is_given(const std::string& option) const;

 private:
  const CLI::App* command_ = nullptr;
};

}  // namespace ricochet
