#pragma once

#include "methods/modes/collocation_polynomial.h"
#include "methods/modes/step_ends.h"

namespace ricochet {

/// The last accepted step, whose polynomial is the first guess of the next one if that begins at either end of it.
class CollocationGuess {
 public:
  CollocationGuess(const Vector& c, int n_q);

  void keep(const StepEnds& ends, const CollocationPolynomial& polynomial);
  void forget() { h_ = 0; }
  /// w_i = v_i - v_0 of the step that begins at the left end. @param w  n_q x n_s
  void predict(const StepEnds& ends, Matrix& w) const;

 private:
  const Vector c_;
  CollocationPolynomial polynomial_;
  Vector v0_, a0_, v1_, a1_;
  double h_ = 0;  // [s]; 0: there is none
};

}  // namespace ricochet
