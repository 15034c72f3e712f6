#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/measure/metrics/metric_tables.h"
#include "reports/metrics.h"
#include "reports/table.h"
#include "reports/verdict.h"

namespace ricochet {

/// One method on one hard case: a cell of the matrix. Run::scene is the id of the case, its label "title" the title, and
/// cases of a group share a table. Statuses beside those of every run: "killed", "crashed", "not_finite".
///
/// Values, all of a success but the first: "t", the time that was reached [s]; "energy_gain", the largest energy above the
/// initial one [J]; "energy_change", at the end minus at the start [J]; "penetration", the deepest [m]; "momentum", the
/// change of the sum of M v [N s]; "cone", the largest ||Lambda_t|| - mu Lambda_n of an impact [N s]. The time is wall time
/// of one run.
struct HardCell : Run {
  static constexpr const char* kKind = "hard_cell";

  CaseLimits limits;

  CaseVerdict verdict() const { return ricochet::verdict(limits, *this); }
  /// Identifier of its row in the table of an experiment, the target of links.
  std::string row_id(const std::string& results) const { return results + "-" + scene + "-" + method; }
};

void to_json(nlohmann::json& j, const HardCell& cell);
void from_json(const nlohmann::json& j, HardCell& cell);

/// It has a verdict that is good.
bool is_right(const HardCell& cell);

/// The cells as a matrix, methods by cases, both in the order of their first cell.
class HardMatrix {
 public:
  explicit HardMatrix(const std::vector<HardCell>& cells);

  struct Case {
    std::string id, title, group;
  };
  const std::vector<std::string>& methods() const { return methods_; }
  const std::vector<Case>& cases() const { return cases_; }
  /// Null where the matrix has no such cell.
  const HardCell* cell(std::size_t method, std::size_t hard_case) const {
    return cells_[method * cases_.size() + hard_case];
  }

 private:
  std::vector<std::string> methods_;
  std::vector<Case> cases_;
  std::vector<const HardCell*> cells_;
};

/// One table per group: verdicts as words.
std::vector<Table> verdict_tables(const std::vector<HardCell>& cells);
/// The words in use: what they mean and how many cells have them.
Table verdict_legend(const std::vector<HardCell>& cells);
/// Per case how many methods got it right, and the smallest error.
Table case_table(const std::vector<HardCell>& cells);
/// Energy at the end minus at the start, with its sign, of every success on the cases that conserve it.
Table energy_table(const std::vector<HardCell>& cells);
/// Every cell that is neither right nor declined: what decided, and the command that repeats it.
Table hard_failures(const std::vector<HardCell>& cells);
/// Successes, with their metrics.
std::vector<MeasuredRun> measured_runs(const std::vector<HardCell>& cells);
/// Every cell with every number.
Table hard_details(const std::vector<HardCell>& cells, const std::string& experiment);

}  // namespace ricochet
