#pragma once

#include "problems/problem.h"

namespace ricochet {

struct StepEnds;

/// The motion between the ends of a collocation step: v - v_0 is the polynomial through zero at the left end and the
/// stages w_i at c_i, q - q_0 - h s v_0 its integral,
///
///   v(s) = v_0 + s (b_0 + s (b_1 + s (..))),   w_i = sum_p b_p c_i^(p+1)                  (1)
///   q(s) = q_0 + h s v_0 + h s^2 (b_0 / 2 + s (b_1 / 3 + s (..)))                        (2)
///
/// of order n_s + 1 in v and n_s + 2 in q. It does not use accelerations, which are large at the ends in stiff motion.
class CollocationPolynomial {
 public:
  CollocationPolynomial(const Vector& c, int n_q);

  /// @param h  [s] @param w  n_q x n_s
  void set(double h, const Matrix& w);
  /// State at theta h from the left end; h is that of the ends, which may have been moved a little along the polynomial.
  void interpolate(double theta, const StepEnds& ends, Vector& q, Vector& v) const;
  /// Bernstein coefficients of (2) over the whole step, in the first n_q rows of `path` with degree() + 1 columns.
  void bernstein(const StepEnds& ends, Matrix& path) const;
  /// The same of (1), in the rows below, in degree() columns.
  void bernstein_of_velocity(const StepEnds& ends, Matrix& path) const;
  /// v(s) - v_0, of one coordinate.
  double velocity(Eigen::Index k, double s) const;
  /// (q(s) - q_0) / h - s v_0, of one coordinate.
  double position(Eigen::Index k, double s) const;
  int degree() const { return static_cast<int>(b_.rows()) + 1; }  ///< of q(s)

 private:
  static double bernstein_coefficient(int k, int d, const auto& monomial);

  double h_ = 0;
  Matrix powers_inverse_;  // of w in (1)
  Matrix b_;               // n_s x n_q
};

}  // namespace ricochet
