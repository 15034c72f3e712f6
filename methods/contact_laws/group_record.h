#pragma once

#include <string>
#include <vector>

#include "methods/contact_laws/group_capture.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Records in the solution of a run what its instants do to groups of contacts, and ends a run that only refuses
/// groups: 100 instants with a refused group (group_capture.h) that together move the time by no more than 1e-12 of the
/// end time.
class GroupRecord {
 public:
  explicit GroupRecord(const ProblemInfo& problem);

  /// After an instant at t [s] that the run has accepted. False where the run has to end, with message() and reason().
  bool add(double t, const GroupInstant& instant, Solution& solution);
  /// The contacts of the group that was refused last, with their rates. @param begin  time at which the run begins [s]
  std::string message(double begin) const;
  FailureReason reason() const;

 private:
  const ProblemInfo& problem_;
  int refusals_ = 0;             // since mark_
  double mark_ = 0;              // [s]
  std::vector<int> refused_;     // of the last of them
  std::vector<double> rates_;    // [m/s]
  std::vector<char> is_in_one_;  // n_c, of a wedge that is recorded; empty before the first
};

}  // namespace ricochet
