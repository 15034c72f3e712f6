#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/event_located.h"

namespace ricochet::reference {

/// A reference solution and what it is good for.
struct Reference {
  Solution solution;       ///< of the tighter Adams run, or a ground truth, which may have sensitivities
  double uncertainty = 0;  ///< bound claimed for the max-norm error of the final (q, v) and of the event times,
                           ///< but for those of an accumulation
  std::string how;         ///< one line: where it comes from

  /// Decimal places that the uncertainty leaves.
  int digits() const;
  /// Error of a solution: final_state_difference(), or sensitivity_difference() when the reference has sensitivities.
  double error_of(const Solution& other) const;
  /// What an error is small against: the max-norm of the final (q, v); 1 for sensitivities, whose error is relative.
  double size() const;
};

/// Four event-located runs, Adams and BDF at two tolerances each. They must agree on the sequence of events, but for the
/// last ones of an accumulation: how many impacts are resolved before one is taken for plastic is rounding. So events
/// that follow each other within 1e-5 of the end time, with two impacts of one contact among them, are compared by
/// their limit: the time of the last one, to 1e-5 of the end time, and the modes after it. The claim
/// is three times the largest difference between the tighter Adams run and the looser Adams run or the tighter BDF run:
/// the two integrators share no formula, and a tolerance ten times looser has a larger error, so an error that all
/// three share would have to be an error of the event logic itself. The looser BDF run has to follow the same motion.
/// @throws std::runtime_error when a run fails or the events differ, with the reason and the contacts
Reference make_reference(const Problem& problem, double tolerance = 1e-14);

/// Max-norm of the difference of the final states (q, v), the error measure E(T) of the paper.
double final_state_difference(const Vector& q, const Vector& v, const Vector& q_reference, const Vector& v_reference);

/// The same for dq and dv: the largest over the columns, each relative to 1 or its max-norm in the reference, whichever
/// is larger. Both solutions have the same columns.
double sensitivity_difference(const Solution& solution, const Solution& reference);

}  // namespace ricochet::reference
