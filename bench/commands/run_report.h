#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "methods/method.h"
#include "problems/json_schema.h"
#include "reference/agreement.h"

namespace ricochet {

/// A run, and what its final state is held against: what `ricochet run` says of it.
struct RunReport {
  const Problem& problem;
  std::string method;  ///< as on the command line
  MethodInfo method_info;
  Settings settings;
  Solution solution;
  double seconds = 0;           ///< wall time
  bool by_differences = false;  ///< its sensitivities are
  std::optional<reference::Reference> reference;
  std::string without_reference;  ///< why there is none

  bool is_certified = false;  ///< the reference is a solution of 42 digits

  /// Error of the final state that a method with error control claims: kClaimed tolerances of the size of the solution,
  /// as its size is that of the reference or of the start. Nothing of fixed steps, which claim none.
  std::optional<double> claim() const;
  /// The difference of the final states is more than the method and a computed reference claim together: one of them is
  /// wrong, and it is not known which.
  bool disagrees() const;

  /// Of which all but one are for differences.
  std::size_t n_solutions() const { return by_differences ? 1 + 4 * settings.sensitivities.size() : 1; }
};

/// Without its error, for which a reader may have to wait. @param most_events  that are shown
void print_run(const RunReport& report, std::size_t most_events);
void print_error(const RunReport& report);

/// Everything, with all digits, as run_schema() describes it; null for a number that does not exist.
nlohmann::ordered_json run_json(const RunReport& report);

/// Of the document that `ricochet run --json` prints.
const JsonSchema& run_schema();

}  // namespace ricochet
