#pragma once

#include <span>
#include <string>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The last check of an accepted step, by none of the formulas that made it. At its right end
///
///   q, v are finite                                                                           (1)
///   f_c^i(q) >= -allowed_i           of open contacts                                        (2)
///   |f_c^i(q)| <= allowed_i          of closed contacts                                      (3)
///   allowed_i = accuracy sum_k |J_n,k| (1 + |q_k| + T |v_k|)                                  (4)
///
/// A step that breaks one ends the run: what it computed is no motion of the scene. (3) finds gaps with a jump, which
/// the stage equations of a closed contact cannot see.
class StepCheck {
 public:
  /// Of an error-controlled method: what its gaps may have gathered when a step is accepted, in tolerances.
  static constexpr double kTolerances = 1000;

  /// @param accuracy  of the method, relative to states of size 1 + |q|; rounding of a long run at least
  StepCheck(const Problem& problem, double accuracy);

  /// Status::success, or what a run that took this step ends with. @param modes  after the step; without any, (2)
  /// holds for all unilateral contacts
  Status operator()(const Vector& q, const Vector& v, std::span<const ContactMode> modes);
  /// Why the last call returned no success.
  std::string message() const;

 private:
  double allowed(int contact, const Vector& q, const Vector& v);

  const Problem& problem_;
  const double accuracy_;
  Vector gap_, J_n_;  // n_c; packed
  int culprit_ = -1;
  bool is_closed_ = false;
};

}  // namespace ricochet
