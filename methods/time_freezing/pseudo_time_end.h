#pragma once

#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/time_freezing/held_contacts.h"
#include "methods/time_freezing/pseudo_time_element.h"

namespace ricochet {

/// The right end of an element while the clock runs: the auxiliary dynamics alone remove, while time stands still, what
/// q1, v1 violate of f_c = 0 where a contact is curved, and of (4), (7) of pseudo_time_equations.h,
///
///   q1 <- q1 - M^-1 C_n (J_n' M^-1 C_n)^-1 f_c(q1),   repeated                                                 (1)
///   v1 <- v1 - M^-1 C (R' M^-1 C)^-1 R' v1                                                                     (2)
///
/// with the columns R = [J_n, J_t of sticking contacts], C the directions of their forces, J_n - mu J_t d where a contact
/// slips along d. M is that of q1 before (1).
class PseudoTimeEnd {
 public:
  PseudoTimeEnd(const Problem& problem, const ButcherTableau& tableau, const HeldContacts& held);

  /// (1), (2), unless the stages leave nothing of them.
  void correct(PseudoTimeElement& e);

 private:
  void correct_position(Vector& q);
  void correct_velocity(const Vector& q, Vector& v);
  bool remove(const Matrix& R, const Matrix& C, const Vector& violation, Vector& x) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const HeldContacts& held_;
  const bool ends_with_stage_;
  Matrix M_;
  Vector J_n_, J_t_;  // packed
};

}  // namespace ricochet
