#include "methods/fesd/element_error.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// |C| 2^p of (2)
double error_constant(const ButcherTableau& tableau) {
  const int p = tableau.order;
  Vector A_p = Vector::Ones(tableau.n_s);
  for (int k = 0; k < p; ++k) A_p = (tableau.A * A_p).eval();
  const double of_stability = tableau.b.dot(A_p) - 1 / std::tgamma(p + 2);
  const double of_quadrature = (tableau.b.dot(tableau.c.array().pow(p).matrix()) - 1.0 / (p + 1)) / std::tgamma(p + 1);
  return std::max(std::abs(of_stability), std::abs(of_quadrature)) * std::pow(2, p);
}

/// x^y to seven digits, which is more than an estimate has.
double power(double x, double y) {
  return std::exp2(static_cast<float>(y * std::log2(static_cast<float>(x))));
}

}  // namespace

ElementError::ElementError(const ButcherTableau& tableau) : n_s_(tableau.n_s), order_(tableau.order) {
  const int n = n_s_;
  bool is_distinct = true;
  for (int j = 0; j < n; ++j) {
    for (int m = 0; m < j; ++m) is_distinct = is_distinct && tableau.c[j] != tableau.c[m];
  }
  if (n < 2 || !is_distinct) {
    throw InputError("tableau of fesd_adaptive", tableau.name,
                     "at least two stages with different nodes c are required, the error estimate needs them");
  }
  Matrix values(n, n);  // P_k(2 c_j - 1)
  for (int j = 0; j < n; ++j) {
    for (int k = 0; k < n; ++k) values(j, k) = std::legendre(static_cast<unsigned>(k), 2 * tableau.c[j] - 1);
  }
  legendre_ = inverse_of(values);
  odd_factorial_ = Vector::Ones(n);
  for (int k = 2; k < n; ++k) odd_factorial_[k] = (2 * k - 1) * odd_factorial_[k - 1];
  error_constant_ = error_constant(tableau);
}

/// (1), (3), relative to the tolerance: the largest of all components. @param w  n_q x n_s
double ElementError::estimate(double h, const Eigen::Ref<const Matrix>& w, const State& q, const State& v,
                              double tolerance) const {
  double worst = 0;
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const double size = w.row(i).cwiseAbs().maxCoeff();
    if (size == 0) continue;
    double decay = 0;
    for (int k = n_s_ - 1; k >= std::max(1, n_s_ - 2); --k) {
      const double alpha = std::abs(legendre_.row(k).dot(w.row(i)));
      decay = std::max(decay, power(odd_factorial_[k] * alpha / size, static_cast<double>(order_) / k));
    }
    const double e_v = error_constant_ * h * size * decay, e_q = h * e_v;
    worst = std::max({worst, e_v / (tolerance * (1 + std::abs(v[i]))), e_q / (tolerance * (1 + std::abs(q[i])))});
  }
  return worst;
}

double ElementError::operator()(const Element& element, double tolerance) const {
  return estimate(element.h, element.a, element.q0, element.v0, tolerance);
}

double ElementError::operator()(const Element& element, MovingContacts& moving, double tolerance) const {
  const double of_state = (*this)(element, tolerance);
  if (moving.empty()) return of_state;
  const Matrix& w = moving.accelerations(element);
  const Vector none = Vector::Zero(w.rows());
  return std::max(of_state, estimate(element.h, w, none, none, tolerance));
}

double ElementError::operator()(const Element& element, const Sensitivity& sensitivity, double tolerance) const {
  double worst = 0;
  for (Eigen::Index k = 0; k < sensitivity.dq().cols(); ++k) {
    const Eigen::Map<const Matrix> dw(sensitivity.stage_accelerations().col(k).data(), element.a.rows(),
                                      element.a.cols());
    worst = std::max(worst, estimate(element.h, dw, sensitivity.dq().col(k), sensitivity.dv().col(k), tolerance));
  }
  return worst;
}

}  // namespace ricochet
