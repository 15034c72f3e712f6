#pragma once

#include <span>
#include <string>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The last check of an accepted step, independent of the formulas that computed it. At its right end
///
///   q, v are finite                                                                           (1)
///   f_c^i(q) >= -allowed_i           of open contacts                                        (2)
///   |f_c^i(q)| <= allowed_i          of closed contacts                                      (3)
///   allowed_i = accuracy sum_k |J_n,k| (1 + |q_k| + T |v_k|)                                  (4)
///   J_n^i does not jump on the line from q_0 to q of closed contacts                          (5)
///
/// with q_0 at its left end. A step that violates one ends the run: its result is not a motion of the scene. (3) finds
/// gaps with a jump, and (5) gaps with a corner that a closed contact has passed without an event; the stage equations
/// of a closed contact see neither. (5) is for contacts that may have corners: the line is bisected, each time in the
/// half where J_n changes more, and the change that remains belongs to one place. It misses a corner that a step passes
/// to and fro.
class StepCheck {
 public:
  /// Accuracy of an error-controlled method, in tolerances: errors of earlier steps add up in the gaps.
  static constexpr double kTolerances = 1000;

  /// @param accuracy  of the method, relative to states of size 1 + |q|; rounding of a long run at least
  StepCheck(const Problem& problem, double accuracy);

  /// Status::success, or the status of a run that ends here. @param modes  within the step; empty: (2) for all
  /// unilateral contacts
  Status operator()(const Vector& q0, const Vector& q, const Vector& v, std::span<const ContactMode> modes);
  /// Why the last call returned no success.
  std::string message() const;

 private:
  double allowed(int contact, const Vector& q, const Vector& v);
  bool passes_corner(int contact, const Vector& q0, const Vector& q);
  Vector normal(int contact, const Vector& q);

  const Problem& problem_;
  const double accuracy_;
  Vector gap_, J_n_;  // n_c; packed
  int culprit_ = -1;
  bool is_closed_ = false, is_corner_ = false;
};

}  // namespace ricochet
