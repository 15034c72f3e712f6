#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/verify/check_row.h"
#include "reports/table.h"

namespace ricochet {

/// Results of all checks of one method.
struct Scorecard {
  std::string method;
  std::vector<CheckRow> rows;
  std::vector<std::string> known;  ///< patterns of GROUP/CHECK whose failure is known, with *: it does not count

  int count(CheckVerdict verdict) const;
  bool is_known(const CheckRow& row) const;
  int known_failures() const;
  /// No failure but known ones, and something that was tried.
  bool holds() const;
  /// Patterns that no failing check fits: what was known has been mended.
  std::vector<std::string> mended() const;
  double seconds() const;
};

/// Lines, one per check, by groups, and the counts.
std::string scorecard_text(const Scorecard& card);
/// Schema ricochet-scorecard-1.
nlohmann::json scorecard_json(const Scorecard& card);
std::string scorecard_junit(const Scorecard& card);
/// For the summary of a workflow: counts, and what fails.
std::string scorecard_markdown(const Scorecard& card);
/// "ricochet | 61 of 64": an SVG of 20 pixels height, green, or red where a check fails that is not known to.
std::string scorecard_badge(const Scorecard& card);

/// A row per method: of each group how many checks passed of those that apply.
Table scorecard_table(const std::vector<CheckRow>& rows);
/// Checks that fail, or all of them.
Table check_table(const std::vector<CheckRow>& rows, bool only_failures);

}  // namespace ricochet
