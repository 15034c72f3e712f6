#pragma once

#include <arb_poly.h>

#include <string>

#include "reference/certified/ball.h"

/// @file
/// The first root of a function that is a polynomial with a bounded remainder.

namespace ricochet::reference::certified {

/// f(tau) = p(tau) + r(tau) with |r| <= rho for 0 <= tau <= 1, where tau = t / h.
class BoundedPolynomial {
 public:
  BoundedPolynomial() {
    arb_poly_init(p);
    arb_poly_init(slope);
  }
  ~BoundedPolynomial() {
    arb_poly_clear(p);
    arb_poly_clear(slope);
  }
  BoundedPolynomial(const BoundedPolynomial&) = delete;
  BoundedPolynomial& operator=(const BoundedPolynomial&) = delete;

  /// Encloses f over all members of tau, which lie in [0, 1].
  Ball at(const Ball& tau, slong bits) const;

  arb_poly_t p;      ///< polynomial
  arb_poly_t slope;  ///< its derivative
  Magnitude rho;     ///< bound of the remainder
};

/// Result of first_root().
struct FirstRoot {
  enum class Kind {
    none,    ///< f > 0 on all of [0, end]
    found,   ///< f > 0 before `root`, which contains the first root
    unknown  ///< neither is proven
  };
  Kind kind = Kind::unknown;
  Ball root;                ///< enclosure of tau
  const char* reason = "";  ///< of unknown
  bool grazes = false;      ///< f > -graze is proven instead of f > 0 somewhere before
};

/// Finds the first root of `f` on [0, end]. f(0) > 0 is required. Intervals are bisected until f > 0 by the mean value
/// theorem, p(m) + (I - m) p'(I) - rho > 0, by the Taylor series of p at the middle of the interval, or by p'' > 0 and
/// the minimum; or until p' < 0 with f > 0 at their beginning and f < 0 at their end. The root then is enclosed by
/// Newton's operator X -> m - (p(m) +- rho) / p'(X).
/// @param graze  a convex minimum above -graze is taken for positive, without a proof; 0 for proofs
FirstRoot first_root(const BoundedPolynomial& f, const Ball& end, const Precision& precision, double graze = 0);

}  // namespace ricochet::reference::certified
