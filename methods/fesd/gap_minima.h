#pragma once

#include "methods/fesd/sign_conditions.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The gap of an open contact between two neighbouring points of an element - left end, stages, right end - as the
/// cubic p that has its values and its rates J_n' v there:
///
///   p(s) >= 0,  0 <= s <= 1                                                             (1)
///
/// FESD-J asks for gaps at the points alone, so that a grazing impact between two of them is no impact. A method that
/// chooses its steps by a tolerance has to see it however long they are. Only a minimum inside the interval can break
/// (1) where the points do not: p falls at the left and rises at the right point.
class GapMinima {
 public:
  /// @param scales  what rounding of the gaps is relative to; read at every call
  GapMinima(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales);

  /// The first closing that (1) finds in an element whose points fulfil the sign conditions.
  Violation check(const Element& stages);

 private:
  void evaluate(const double* q, const double* v);

  const Problem& problem_;
  const ButcherTableau& tableau_;
  const ContactScales& scales_;
  Vector J_n_;
  Vector gap_, rate_, left_gap_, left_rate_;  // n_c
};

}  // namespace ricochet
