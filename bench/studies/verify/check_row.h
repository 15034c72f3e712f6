#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

enum class CheckVerdict { pass, fail, not_applicable };
NLOHMANN_JSON_SERIALIZE_ENUM(CheckVerdict, {{CheckVerdict::fail, "fail"},
                                            {CheckVerdict::pass, "pass"},
                                            {CheckVerdict::not_applicable, "not applicable"}})

/// "pass", "fail", "not applicable"
const char* to_string(CheckVerdict verdict);

/// Result of a check.
struct CheckResult {
  CheckVerdict verdict = CheckVerdict::fail;
  std::string reason;     ///< what was measured, and why it is enough or not
  std::string command;    ///< that shows it; empty where there is none
  bool is_judged = true;  ///< false: a wrong answer that is only shown, and does not count

  static CheckResult pass(std::string reason, std::string command = "");
  static CheckResult fail(std::string reason, std::string command = "");
  static CheckResult not_applicable(std::string reason);
  static CheckResult not_judged(const std::string& reason);
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(CheckResult, verdict, reason, command, is_judged)

/// One check of one method: a line of the scorecard.
struct CheckRow : CheckResult {
  static constexpr const char* kKind = "verify_check";

  std::string method, group, check;
  double seconds = 0;  ///< wall time

  std::string name() const { return group + "/" + check; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(CheckRow, method, group, check, verdict, reason, command, is_judged,
                                                seconds)

}  // namespace ricochet
