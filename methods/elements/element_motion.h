#pragma once

#include "methods/elements/element.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/motion.h"

namespace ricochet {

/// The motion within an element: the polynomial of degree s - 1 through the accelerations of the stages, integrated,
///
///   v(theta) = v_0 + h int_0^theta w,   q(theta) = q_0 + h int_0^theta v,   w(c_j) = w_j                      (1)
///
/// For Gauss and Radau IIA this is the collocation polynomial, of order s + 1 in v; for any tableau it is corrected to
/// reach the state at the right end by
///
///   x(theta) + theta^(s + 1) (x_1 - x(1))                                                                    (2)
///
/// which is of the order of the tableau. If no polynomial passes through the stages, (1) is the cubic through q and v
/// at both ends. Of tableaus that hold accelerations it is the polynomial of degree 5 through q, v and v' at both ends.
class ElementMotion {
 public:
  explicit ElementMotion(const ButcherTableau& tableau);

  /// Adds a solved element. @param begin, end  of it [s]
  void add(double begin, double end, const Element& element, Motion& motion) const;

 private:
  void add_between_ends(double begin, double end, const Element& element, Motion& motion) const;

  const int n_s_;
  const bool between_ends_;
  Matrix w_;  // n_s x n_s: row m, column j: coefficient of theta^m in the polynomial that is 1 at c_j; empty without
};

}  // namespace ricochet
