#include "methods/modes/collocation_polynomial.h"

#include "methods/modes/step_ends.h"
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

/// b_k = sum_i (k over i) / (d over i) m_i, with the coefficients m_i of s^i
double CollocationPolynomial::bernstein_coefficient(int k, int d, const auto& monomial) {
  double sum = 0, ratio = 1;
  for (int i = 0; i <= k; ++i) {
    sum += ratio * monomial(i);
    ratio *= static_cast<double>(k - i) / (d - i);
  }
  return sum;
}

void CollocationPolynomial::bernstein(const StepEnds& ends, Matrix& path) const {
  const int d = degree();
  const double h = ends.h;
  for (Eigen::Index row = 0; row < b_.cols(); ++row) {
    const auto monomial = [&](int i) {
      if (i == 0) return ends.q0[row];
      if (i == 1) return h * ends.v0[row];
      return h * b_(i - 2, row) / i;
    };
    for (int k = 0; k < d; ++k) path(row, k) = bernstein_coefficient(k, d, monomial);
    path(row, d) = ends.q1[row];
  }
}

void CollocationPolynomial::bernstein_of_velocity(const StepEnds& ends, Matrix& path) const {
  const int d = degree() - 1;
  const Eigen::Index n = b_.cols();
  for (Eigen::Index row = 0; row < n; ++row) {
    const auto monomial = [&](int i) { return i == 0 ? ends.v0[row] : b_(i - 1, row); };
    for (int k = 0; k < d; ++k) path(n + row, k) = bernstein_coefficient(k, d, monomial);
    path(n + row, d) = ends.v1[row];
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
