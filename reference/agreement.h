#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/event_located.h"

namespace ricochet::reference {

/// A reference solution and its uncertainty.
struct Reference {
  Solution solution;        ///< of the tighter Adams run, or a ground truth, which may have sensitivities
  double uncertainty = 0;   ///< claimed bound of the max-norm error of the final (q, v) and of the event times, except
                            ///< those of an accumulation
  bool ends_early = false;  ///< where ProblemInfo::until vanishes: the time of the end counts like a coordinate
  std::string how;          ///< origin, one line
  bool is_truth = false;  ///< proven, or known to many digits: a solution that differs by more than its claim is wrong

  /// "truth proven to 22 decimals", "truth reference/data/ground_truth.json", "reference CVODE with event location"
  std::string title() const;

  /// Number of certain decimal places.
  int digits() const;
  /// Error of a solution: final_state_difference(), or sensitivity_difference() if the reference has sensitivities.
  double error_of(const Solution& other) const;
  /// Scale of the error: the max-norm of the final (q, v); 1 for sensitivities, whose error is relative.
  double size() const;
};

/// Makes four event-located runs, Adams and BDF at two tolerances each. They must agree on the sequence of events,
/// except the last ones of an accumulation: rounding decides how many impacts are resolved before one counts as
/// plastic. Events within 1e-5 of the end time of each other, with two impacts of one contact among them, are therefore
/// compared by their limit: the time of the last one, to 1e-5 of the end time, and the modes after it. The claimed
/// uncertainty is five times the largest difference between the tighter Adams run and the looser Adams run or the
/// tighter BDF run, and at least ten tolerances; proofs showed three times to be too few. The two integrators share no
/// formula, and a tolerance ten times looser has a larger error; an error common to all three would have to be in the
/// event logic. The looser BDF run must follow the same motion.
/// @throws std::runtime_error if a run fails or the events differ, with the reason and the contacts
Reference make_reference(const Problem& problem, double tolerance = 1e-14);

/// Max-norm of the difference of the final states (q, v), the error measure E(T) of the paper.
double final_state_difference(const Vector& q, const Vector& v, const Vector& q_reference, const Vector& v_reference);

/// Error of dq and dv: the largest over the columns, each relative to 1 or to its max-norm in the reference,
/// whichever is larger. Both solutions have the same columns.
double sensitivity_difference(const Solution& solution, const Solution& reference);

}  // namespace ricochet::reference
