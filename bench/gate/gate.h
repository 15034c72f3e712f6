#pragma once

#include <string>
#include <tuple>
#include <vector>

#include "bench/studies/grid/grid_results.h"

namespace ricochet {

/// The gate: results held against a baseline, run by run. Results e, r, c (error, largest residual, a counter) may not
/// be worse than those of the baseline, e_0, r_0, c_0, beyond what a last bit can do, for numbers differ in rounding
/// between processors and compilers. With x the size of the solution and u the uncertainty of the reference, a run of
/// fixed steps holds when
///
///   e <= 1.1 e_0 + a,   a = 1e-11 x + 2 u              for asymptotic errors, e_0 < 0.3 % of x   (1)
///   e <= 10 e_0 + a                                    for coarse ones                           (2)
///   c <= c_0 + max(2, c_0 / 10)                        for every counter                         (3)
///   c <= c_0 + max(10, c_0 / 2)                        for Jacobians and Newton matrices         (4)
///
/// and a method when
///
///   r <= 10 r_0 + a                                    largest residuals of all its runs         (5)
///   c <= c_0 + max(2, c_0 / 10)                        sums of every counter over its runs       (6)
///   p >= p_0 - 0.1                                     slopes over the window of the baseline    (7)
///
/// The reasons. (1): compilers and fused multiply-adds change errors by rounding; a is ten times larger for derivatives,
/// whose rounding is that of the motion times a condition number (1.4e-11 was seen). (2): an error-controlled method
/// chooses its steps by decisions that a last bit can turn, so that its error may be as in (2), or that of the next
/// coarser tolerance of the baseline if that is larger (factors of 30 were seen). (4): whether Newton's method renews
/// its matrix is such a decision (13 and 16 times were seen); the sum (6) averages them out. (5): a residual is
/// rounding, or that of a switch which rounding decides; then it moves from run to run of a method, and not between
/// methods. (7): an error that has become smaller counts as what it was, and one that is larger within a as well, so
/// that the slope falls by runs that got worse alone.
///
/// A smaller error or less work never blocks. What cannot be compared does: a run that only one of the two has, a
/// success without an error or without its steps, a negative error, an unknown status, a method that is not built, a
/// residual that is audited no more, another reference. A run that fails in both is compared.
struct GateRules {
  static constexpr double kErrorFactor = 1.1, kCoarseErrorFactor = 10;          // (1), (2)
  static constexpr double kRounding = 1e-11, kRoundingOfDerivatives = 1e-10;    // of a
  static constexpr double kCounterShare = 0.1, kCounterLeast = 2;               // (3), (6)
  static constexpr double kMatrixCounterShare = 0.5, kMatrixCounterLeast = 10;  // (4)
  static constexpr double kResidualFactor = 10;                                 // (5)
  static constexpr double kOrderSlack = 0.1;                                    // (7)
  static constexpr double kSizeTolerance = 1e-4;       ///< of x between the two: the baseline has six digits
  static constexpr double kReferenceErrorFactor = 10;  ///< of u: an estimate by the agreement of two integrators
};

/// Whether a counter is more than (3) or (4) allows: by more than a share of what it was, and by more than the least.
bool is_more_work(double then, double now, double share, double least);

enum class GateVerdict { same, better, worse, not_compared };
const char* to_string(GateVerdict verdict);

/// Verdict on a run of the baseline or of the results, or on a method: all runs, order, work or residual.
struct GateLine {
  std::string method;
  std::string what = "run";  ///< or "all runs", "order", "work", "residual"; of a benchmark "counters"
  std::string setting{};     ///< of a run: "50", "1e-08", "50 in place of fesd:gauss:1"
  int line = 0;              ///< of the baseline file; 0 for what it does not have
  GateVerdict verdict = GateVerdict::same;
  std::vector<std::string> findings{};

  /// "fesd:gauss:3 at 50", "fesd:gauss:3, order"
  std::string name() const { return what == "run" ? method + " at " + setting : method + ", " + what; }
  /// The verdict is the gravest of all findings.
  void add(GateVerdict kind, std::string finding);
};

struct GateReport {
  std::string experiment, results, baseline;  ///< id, files
  std::vector<GateLine> lines;

  int count(GateVerdict verdict) const;
  int compared() const { return static_cast<int>(lines.size()) - count(GateVerdict::not_compared); }
  /// Something was compared, nothing is worse, and nothing was left out.
  bool holds() const;
};

/// @throws InputError for results of another experiment, or a quick run held against a whole one
GateReport hold_against(const GridResults& baseline, const GridResults& results);

/// Identity of a run in its results: method, steps, tolerance, and the method that it stands in for.
using GateKey = std::tuple<std::string, int, double, std::string>;
GateKey key_of(const Run& record);

/// One of Status, "declined" or "not_built".
bool is_known_status(const std::string& status);

}  // namespace ricochet
