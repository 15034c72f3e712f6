#pragma once

#include "problems/problem.h"

namespace ricochet {

/// A Runge-Kutta element of the time-freezing system, in pseudo time, with all its values. Its equations are in
/// pseudo_time_equations.h.
struct PseudoTimeElement {
  double h = 0;               ///< length in pseudo time [s]
  Vector q0, v0;              ///< n_q: left end
  Vector y0;                  ///< n_c: depth of a bounce at the left end [m]
  Matrix q, v, w;             ///< n_q x n_s: stages, w = v'
  Matrix y;                   ///< n_c x n_s
  Vector s;                   ///< n_s: speed of time
  Matrix beta;                ///< n_c x n_s: weights of the auxiliary dynamics, normal
  Matrix tau;                 ///< n_lambda_t x n_s: the same, tangential
  Vector q1, v1, y1;          ///< right end
  Vector Lambda_n, Lambda_t;  ///< n_c, n_lambda_t: impulses of a frozen element [N s]

  void resize(const ProblemInfo& info, int n_s);
  /// First guess: the same derivatives at all stages. @param derivative  n_q: v'; @param normal  n_c: beta;
  /// @param tangential  n_lambda_t: tau
  void guess(double length, double speed, const Vector& derivative, const Vector& normal, const Vector& tangential);
};

}  // namespace ricochet
