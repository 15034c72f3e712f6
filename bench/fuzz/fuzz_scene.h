#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "reports/run.h"
#include "reports/table.h"

namespace ricochet {

/// A run of one method on a random scene.
struct FuzzResult {
  std::string method;  ///< as on the command line
  Setting setting;
  std::string status, message;  ///< to_string(Status), "declined", "killed" or "crashed"
  FailureReason reason = {};
  std::vector<double> q, v;  ///< final state of a success
  double error = 0;          ///< that the judge allows it, max-norm of (q, v)
  /// Distance from the truth over the tolerance and the size of the state, for methods whose first answer counts and
  /// scenes with a truth; else 0
  double tolerances = 0;
  double seconds = 0;  ///< wall time

  bool succeeded() const { return status == "success"; }
  bool is_killed_or_crashed() const { return status == "killed" || status == "crashed"; }
  /// Reason of the failure, without numbers and names of contacts, so that equal reasons are counted together.
  std::string reason_class() const;
  /// The command that repeats the run.
  std::string command(const std::string& scene_file) const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(FuzzResult, method, setting, status, message, reason, q, v, error,
                                                tolerances, seconds)

/// The motion of a random scene by `ricochet truth`.
struct FuzzTruth {
  std::string grade;         ///< "proven", "assumed" or "open"; "killed", "crashed"; empty if none was asked for
  std::string reason;        ///< why it is open; the first assumption
  int decimals = 0;          ///< of the scene's own units
  std::vector<double> q, v;  ///< final state with the clock, as of FuzzResult; empty if it is open
  double error = 0;          ///< bound of its error, max-norm of (q, v)
  double seconds = 0;        ///< wall time

  bool is_known() const { return grade == "proven" || grade == "assumed"; }
  bool is_killed_or_crashed() const { return grade == "killed" || grade == "crashed"; }
  /// Why it is open, without numbers and names of contacts.
  std::string reason_class() const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(FuzzTruth, grade, reason, decimals, q, v, error, seconds)

/// Verdict on a scene, by the rule in bench/fuzz/judge.h.
enum class FuzzVerdict {
  agree,      ///< a proof, or at least two methods, give the motion, and all methods that succeed agree with it
  wrong,      ///< a method other than time stepping differs from the proven motion
  sensitive,  ///< they differ by no more than what the motion makes of rounding and tolerances
  open,       ///< they differ, and a method that declined says that the motion is not unique
  outvoted,   ///< time stepping alone differs from the proven motion, or from fesd_adaptive and CVODE, which agree
  collapse,   ///< time stepping alone differs, and event location met impacts of several contacts that accumulate
  undecided,  ///< no two methods confirm each other
  declined,   ///< none succeeds: the scene may have no motion, as an impact that jams with friction has none
  disagree,
  hangs  ///< a method did not come back, or its process died
};
NLOHMANN_JSON_SERIALIZE_ENUM(FuzzVerdict, {{FuzzVerdict::agree, "agree"},
                                           {FuzzVerdict::wrong, "wrong"},
                                           {FuzzVerdict::sensitive, "sensitive"},
                                           {FuzzVerdict::open, "open"},
                                           {FuzzVerdict::outvoted, "outvoted"},
                                           {FuzzVerdict::collapse, "collapse"},
                                           {FuzzVerdict::undecided, "undecided"},
                                           {FuzzVerdict::declined, "declined"},
                                           {FuzzVerdict::disagree, "disagree"},
                                           {FuzzVerdict::hangs, "hangs"}})
std::string word_of(FuzzVerdict verdict);
/// Whether the verdict tells of an error of a method: wrong, disagree or hangs.
bool is_finding(FuzzVerdict verdict);

/// A random scene: a line of the results file.
struct FuzzScene {
  static constexpr const char* kKind = "fuzz_scene";

  std::string family;
  int seed = 0, number = 0;
  FuzzVerdict verdict = FuzzVerdict::agree;
  std::string detail;      ///< which methods differ, by how much and how much was allowed
  std::string parties;     ///< the two that differ most, relative to what was allowed: methods, or one and the truth
  double difference = 0;   ///< largest between two that succeeded
  double sensitivity = 0;  ///< spread under disturbances and other tolerances, where it was measured
  std::string file;        ///< minimised scene, where one was saved
  FuzzTruth truth;
  std::vector<FuzzResult> results;
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(FuzzScene, family, seed, number, verdict, detail, parties, difference,
                                                sensitivity, file, truth, results)

/// Families by verdicts, and how often each method declined: numbers and percents.
Table fuzz_table(const std::vector<FuzzScene>& scenes);
/// Per method and family why it declined, and how often.
Table fuzz_reasons(const std::vector<FuzzScene>& scenes);
/// Per family with proven motions: the errors of fesd_adaptive and event_driven in multiples of the tolerance.
Table fuzz_accuracy(const std::vector<FuzzScene>& scenes);
/// The scenes on which methods disagree, are wrong or hang.
Table fuzz_findings(const std::vector<FuzzScene>& scenes);

}  // namespace ricochet
