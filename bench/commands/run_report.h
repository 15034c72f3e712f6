#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "methods/method.h"
#include "problems/json_schema.h"
#include "reference/agreement.h"

namespace ricochet {

/// Report of a single run, with its reference solution.
struct RunReport {
  const Problem& problem;
  std::string method;  ///< as on the command line
  MethodInfo method_info;
  Settings settings;
  Solution solution;
  double seconds = 0;           ///< wall time
  bool by_differences = false;  ///< sensitivities are finite differences
  std::optional<reference::Reference> reference;
  std::string without_reference;  ///< reason, if there is no reference

  /// Claimed error of the final state of an error-controlled method: kClaimed tolerances relative to the size of the
  /// solution, of the reference or of the initial state. None for fixed steps.
  std::optional<double> claim() const;
  /// Whether the final states differ by more than the sum of the claimed errors of the method and the reference.
  bool exceeds_claims() const;
  /// exceeds_claims(), and the reference is computed: one of them is wrong, and it is unknown which.
  bool disagrees() const { return exceeds_claims() && !reference->is_truth; }

  /// Number of solutions in `seconds`; all but one are for differences.
  std::size_t n_solutions() const { return by_differences ? 1 + 4 * settings.sensitivities.size() : 1; }
};

/// Prints all but the error, whose reference may take seconds. @param most_events  limit of the events that are printed
void print_run(const RunReport& report, std::size_t most_events);
void print_error(const RunReport& report);

/// The report with all digits, as described by run_schema(); null for a number that does not exist.
nlohmann::ordered_json run_json(const RunReport& report);

/// Schema of the document that `ricochet run --json` prints.
const JsonSchema& run_schema();

}  // namespace ricochet
