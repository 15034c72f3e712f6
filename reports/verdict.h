#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "reports/run.h"

namespace ricochet {

inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Limits that a run of a hard case must keep, from the file of the cases. NaN: not required.
struct CaseLimits {
  double exact = kNoNumber;        ///< error that counts as rounding, max-norm of (q, v)
  double error = kNoNumber;        ///< error that counts as accurate, the same norm
  double energy = kNoNumber;       ///< largest energy above the initial one [J]
  double penetration = kNoNumber;  ///< deepest gap below zero [m]
  double momentum = kNoNumber;     ///< change of the sum of M v [N s]
  double cone = kNoNumber;         ///< ||Lambda_t|| - mu Lambda_n of an impact [N s]
  /// Contact at which no force, or more than one, continues the motion; empty for an ordinary case. The true motions
  /// are then those that an impulse, or the choice of a force, allows.
  std::string paradox;
  bool conserves_energy = false;  ///< a loss of more than `energy` until the end is a violation, too
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(CaseLimits, exact, error, energy, penetration, momentum, cone, paradox,
                                                conserves_energy)

/// By the first line that applies:
///
///   (1)  crashed       the process died, or threw what a method must not throw
///   (2)  killed        no result within twice the time limit
///   (3)  declined      the method cannot run this problem
///   (4)  time_limit    status time_limit
///   (5)  not_finite    the method reported success, and a number is not finite
///   (6)  refuses       no success in a paradox, and the reason is that its contact has no motion, or several
///   (7)  fails         no success
///   (8)  violates_energy, penetrates, changes_momentum, leaves_cone
///                      success beyond a limit of the case, the first of these
///   (9)  resolves      success in a paradox, within `error` of one of its motions
///   (10) wrong         success in a paradox, and none of its motions
///   (11) keeps         success within all limits, and the case states no true motion
///   (12) exact         error <= exact
///   (13) accurate      error <= error
///   (14) inaccurate
enum class CaseVerdict {
  exact,
  accurate,
  keeps,
  refuses,
  resolves,
  declined,
  inaccurate,
  violates_energy,
  penetrates,
  changes_momentum,
  leaves_cone,
  fails,
  time_limit,
  wrong,
  not_finite,
  killed,
  crashed
};

/// @param run  of a hard case, bench/studies/hard_cases/hard_cell.h
CaseVerdict verdict(const CaseLimits& limits, const Run& run);

/// Grade of a verdict, for colours and counts.
enum class Grade { good, neutral, poor, bad };
NLOHMANN_JSON_SERIALIZE_ENUM(
    Grade, {{Grade::bad, "bad"}, {Grade::good, "good"}, {Grade::neutral, "neutral"}, {Grade::poor, "poor"}})

struct VerdictText {
  const char* word;     ///< short, for a matrix
  const char* meaning;  ///< a phrase
  Grade grade;
};
const VerdictText& text_of(CaseVerdict verdict);

/// The number that decided: "error 3.1e-05", "energy +0.2 J", "after 5.0 s", or the method's reason.
std::string decisive_number(CaseVerdict verdict, const Run& run);

}  // namespace ricochet
