#include "methods/event_driven/collocation_polynomial.h"

#include "methods/event_driven/step_ends.h"
#include "problems/dense_solve.h"

namespace ricochet {

CollocationPolynomial::CollocationPolynomial(const Vector& c, int n_q) : b_(Matrix::Zero(c.size(), n_q)) {
  Matrix powers(c.size(), c.size());
  powers.col(0) = c;
  for (Eigen::Index p = 1; p < c.size(); ++p) powers.col(p) = powers.col(p - 1).cwiseProduct(c);
  powers_inverse_ = solve_partial_pivoting(powers, Matrix::Identity(c.size(), c.size()));
}

void CollocationPolynomial::set(double h, const Matrix& w) {
  h_ = h;
  b_.noalias() = powers_inverse_.lazyProduct(w.transpose());
}

void CollocationPolynomial::interpolate(double theta, const StepEnds& ends, Vector& q, Vector& v) const {
  if (theta == 1) {  // without the rounding of large coefficients
    q = ends.q1;
    v = ends.v1;
    return;
  }
  const double s = theta * ends.h / h_;
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    q[k] = ends.q0[k] + h_ * (s * ends.v0[k] + position(k, s));
    v[k] = ends.v0[k] + velocity(k, s);
  }
}

/// (1)
double CollocationPolynomial::velocity(Eigen::Index k, double s) const {
  double sum = 0;
  for (Eigen::Index p = b_.rows() - 1; p >= 0; --p) sum = b_(p, k) + s * sum;
  return s * sum;
}

/// (2)
double CollocationPolynomial::position(Eigen::Index k, double s) const {
  double sum = 0;
  for (Eigen::Index p = b_.rows() - 1; p >= 0; --p) sum = b_(p, k) / static_cast<double>(p + 2) + s * sum;
  return s * s * sum;
}

}  // namespace ricochet
