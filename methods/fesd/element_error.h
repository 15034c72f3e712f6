#pragma once

#include "methods/elements/fesd_step.h"
#include "methods/fesd/moving_contacts.h"
#include "methods/fesd/sensitivity.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// Estimate of the local error of an element. Its accelerations w(c), as a polynomial through the n_s stages, have
/// Legendre coefficients
///
///   alpha_k = sum_j L_kj w_j,   sum_k alpha_k P_k(2 c_j - 1) = w_j.                                           (1)
///
/// Where the solution behaves like exp(lambda t), |alpha_k| / |w| is about x^k / (2 k - 1)!!, x = |lambda| h / 2, and a
/// method of order p leaves an error of |C| (2 x)^p h |w| in the velocity, with C the first coefficient of its
/// stability function that is not that of exp,
///
///   C = b' A^p 1 - 1 / (p + 1)!,   or  (b' c^p - 1 / (p + 1)) / p!  of its quadrature if that is larger.      (2)
///
/// For each velocity, x follows from the last coefficient alpha_k, and from the one before it in case the last is small
/// by chance:
///
///   e_v = |C| 2^p h |w| max over k = n_s - 1, n_s - 2 >= 1 of ((2 k - 1)!! |alpha_k| / |w|)^(p / k),   e_q = h e_v.  (3)
///
/// This is the local error of order p + 1 itself, not that of an embedded method of lower order, and needs no
/// evaluation. Where surfaces move by themselves, gaps and slip paths are estimated as well (moving_contacts.h).
class ElementError {
 public:
  /// @throws InputError with fewer than two stages, or two of the same node c: (1) needs them
  explicit ElementError(const ButcherTableau& tableau);

  /// The largest e / (tolerance (1 + |x|)) of all components x of q and v, at most 1 when the element is accepted.
  double operator()(const Element& element, double tolerance) const;
  /// The largest error, including gaps and slip paths of moving contacts.
  double operator()(const Element& element, MovingContacts& moving, double tolerance) const;
  /// The largest error of the derivatives in the element that was added last.
  double operator()(const Element& element, const Sensitivity& sensitivity, double tolerance) const;

 private:
  using State = Eigen::Ref<const Vector>;
  double estimate(double h, const Eigen::Ref<const Matrix>& w, const State& q, const State& v, double tolerance) const;

  int n_s_ = 0, order_ = 0;
  Matrix legendre_;            // L of (1)
  Vector odd_factorial_;       // (2 k - 1)!!
  double error_constant_ = 1;  // |C| 2^p
};

}  // namespace ricochet
