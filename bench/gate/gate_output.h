#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/gate/gate.h"

namespace ricochet {

// Findings of a gate, for people and for machines. All of these functions return text; the command writes the files.

/// A line per finding and one that sums up.
std::string gate_text(const GateReport& report);

/// {"holds", "experiments": [{"experiment", "results", "baseline", "holds", "compared", "worse", "not_compared",
/// "better", "lines": [{"method", "what", "setting", "verdict", "findings", "line"}]}]}
nlohmann::json gate_json(const std::vector<GateReport>& reports);

/// JUnit XML: a test suite per experiment, a test case per run and per method. `worse` is a failure, `not_compared` an
/// error. Characters that XML 1.0 forbids and broken UTF-8 become U+FFFD.
std::string gate_junit(const std::vector<GateReport>& reports);

/// A Markdown section: counts, a table of what blocks, and what is better, folded. A summary may hold a megabyte: 200
/// lines of each.
std::string gate_markdown(const std::vector<GateReport>& reports);

/// Workflow commands of GitHub Actions: `::error file=BASELINE,line=N,title=...::...` for what blocks, `::notice` for
/// what is better. GitHub shows ten errors and ten notices of a step, so the tenth says how many more there are.
std::string gate_annotations(const std::vector<GateReport>& reports);

}  // namespace ricochet
