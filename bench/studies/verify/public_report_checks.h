#pragma once

#include <string>
#include <vector>

#include "bench/studies/verify/check.h"
#include "reports/table.h"

namespace ricochet {

/// A scene made from a public report, with its right answer: an entry of reference/data/public_reports/cases.json.
struct PublicReport {
  std::string name, scene;   ///< the path of the scene file
  std::vector<double> q, v;  ///< at the end time, without the clock; empty where the scene has no motion until then
  double tolerance = 0;      ///< to which the answer is known
  bool has_corners = false;  ///< kinked gaps, forces that jump or bend: judged for methods with regions
  std::vector<std::string> must_succeed;  ///< names of methods

  bool has_motion() const { return !q.empty(); }
  double size() const;  ///< the largest number of the answer, at least 1
};

/// @throws InputError for a file that cannot be read
std::vector<PublicReport> read_public_reports(const std::string& file);

/// Settings, and the errors that are allowed.
struct PublicReportRule {
  int first_order_steps, steps;
  double tolerance;
  double error;             ///< of fixed steps, relative to the size of the answer
  double factor;            ///< of error-controlled methods: times the tolerance of the answer and its size
  double multistep_factor;  ///< of CVODE and IDA, whose tolerance is of one step of thousands, and
                            ///< of methods of order 1 at impacts, whose tolerance is of the time of an impact
};

/// A method of fixed steps takes `first_order_steps` if it is of first order. Of higher order it takes `steps`, and
/// `first_order_steps` where that answer is wrong. pass: the answer is right. fail: a success with a wrong answer, or no
/// end. not applicable: the method declined, with its reason; or a wrong answer that is not judged: of a scene with
/// corners, or of a method of first order, whose steps are too long for 1 %.
CheckResult answer_of(const PublicReport& report, const PublicReportRule& rule, const Subject& subject);

/// Methods by how many of their answers are correct, declined, wrong, and not judged.
Table public_report_table(const std::vector<CheckRow>& rows);

inline constexpr const char* kPublicReportGroup = "public report";

}  // namespace ricochet
