#pragma once

#include "methods/modes/collocation_polynomial.h"
#include "methods/runge_kutta/quintic.h"
#include "problems/problem.h"

namespace ricochet {

/// The two ends of a step, with the accelerations there. Between them the motion is (1) of quintic.h of each coordinate,
/// of order 6 in q and 5 in v, or the polynomial of a step that has its own.
struct StepEnds {
  double h = 0;       ///< [s]
  Vector q0, v0, a0;  ///< n_q, left end
  Vector q1, v1, a1;  ///< n_q, right end

  const CollocationPolynomial* collocation = nullptr;  ///< in place of that; null: none

  void resize(int n_q) {
    for (auto* x : {&q0, &v0, &a0, &q1, &v1, &a1}) x->setZero(n_q);
  }
  /// The right end becomes the left end.
  void advance() {
    q0.swap(q1);
    v0.swap(v1);
    a0.swap(a1);
  }
  /// Degree of the polynomial between the ends.
  int degree() const { return collocation ? collocation->degree() : 5; }
  /// State at theta h from the left end, theta in [0, 1].
  void interpolate(double theta, Vector& q, Vector& v) const;
  /// Bernstein coefficients of q, in the first n_q rows of `path` with at least degree() + 1 columns, and the estimates
  /// of (2) there; a collocation polynomial has the error of the step.
  void bernstein(Matrix& path, Vector& error) const;
  /// The same of v, in the rows of `path` below those of q.
  void bernstein_of_velocity(Matrix& path) const;

 private:
  void raise(Matrix& path, Eigen::Index first, int degree) const;
};

}  // namespace ricochet
