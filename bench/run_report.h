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
