#pragma once

#include "methods/event_driven/radau_system.h"
#include "methods/modes/step_ends.h"

namespace ricochet {

/// Estimate of the error of a step of Radau IIA by a formula of order s = n_s that has the real eigenvalue g of A as its
/// weight at the left end,
///
///   e = (I - h g J)^-1 (h g (v_0, a_0) + sum_i e_i (q_i - q_0, w_i)),   e' = d' A^-1       (1)
///   sum_i d_i c_i^(k-1) = -g for k = 1, else 0,   k = 1, .., s                           (2)
///
/// with J the Jacobian of the first-order system, so that the matrix is (2) of radau_system.h for g. It has order s,
/// the step 2 s - 1, so that a tolerance of
///
///   0.1 tolerance^((s + 1) / (2 s))                                                      (3)
///
/// for e keeps the error of the step in proportion to the tolerance. Besides e_q and e_v,
///
///   |(e_q)_k (a_q e_q)_k|^(1/2)                                                          (4)
///
/// counts as an error of v_k: the velocity that belongs to the potential energy of e_q. An oscillation that a step does
/// not resolve can have its whole error in q at the right end, where it is smaller than that of v by the frequency; with
/// (4) the estimate does not depend on the phase. Where a step is rejected, (8.20) of the source filters e once more;
/// it is left out, since of an oscillation of frequency y / h it lets the part 1 / (g y) through: after an impact steps
/// would damp what they should follow.
///
/// Source: as of RadauStep, and RADAU for (3).
class RadauError {
 public:
  /// @param g  the real eigenvalue of A
  RadauError(const ButcherTableau& tableau, double g, int n_q);

  /// (1) and the squares of (4). @param q, w  n_q x n_s: stages q_i, w_i; @param system  with the factors of the step
  void estimate(const StepEnds& ends, const Matrix& q, const Matrix& w, const Matrix& a_q, RadauSystem& system);
  /// Root mean square of the last estimate, in parts of (3).
  double in_parts_of(double tolerance, const StepEnds& ends) const;

  const Vector& weights() const { return weights_; }  ///< e_i of (1)

 private:
  const double g_;
  Vector weights_;
  Vector e_q_, e_v_, e_energy_;  // n_q
};

}  // namespace ricochet
