#pragma once

#include <span>
#include <string>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Ends runs without progress: every `steps` steps must advance the time by the fraction `least` of the end time.
class ProgressLimit {
 public:
  /// @param least  fraction of the end time
  ProgressLimit(const ProblemInfo& problem, long steps, double least)
      : problem_(problem), steps_(steps), least_(least * problem.end_time), next_(steps) {}

  /// Whether the steps up to `count`, at time t [s], are too many.
  bool is_passed(long count, double t) {
    if (count < next_) return false;
    next_ = count + steps_;
    moved_ = t - mark_;
    mark_ = t;
    return moved_ < least_;
  }
  /// Message after the limit is passed: names the slipping contacts, or else the closed ones. @param modes  of the
  /// contacts
  std::string message(std::span<const ContactMode> modes) const;

 private:
  const ProblemInfo& problem_;
  const long steps_;
  const double least_;           // [s]
  long next_;                    // count of the next check
  double mark_ = 0, moved_ = 0;  // [s]
};

}  // namespace ricochet
