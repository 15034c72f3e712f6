#include "methods/event_driven/radau_error.h"

#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

Matrix inverse(const Matrix& A) {
  return solve_partial_pivoting(A, Matrix::Identity(A.rows(), A.cols()));
}

}  // namespace

RadauError::RadauError(const ButcherTableau& tableau, double g, int n_q) : g_(g) {
  const int n_s = tableau.n_s;
  Matrix powers = Matrix::Ones(n_s, n_s);  // (2)
  for (Eigen::Index k = 1; k < n_s; ++k) powers.row(k) = powers.row(k - 1).cwiseProduct(tableau.c.transpose());
  const Matrix A_inverse_transposed = inverse(tableau.A).transpose();
  weights_ = A_inverse_transposed * (-g * inverse(powers).col(0));
  e_q_ = e_v_ = e_energy_ = Vector::Zero(n_q);
}

void RadauError::estimate(const StepEnds& ends, const Matrix& q, const Matrix& w, const Matrix& a_q,
                          RadauSystem& system) {
  const double hg = ends.h * g_;
  e_q_ = hg * ends.v0;
  e_v_ = hg * ends.a0;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    e_q_ += weights_[i] * (q.col(i) - ends.q0);
    e_v_ += weights_[i] * w.col(i);
  }
  for (Eigen::Index k = 0; k < e_v_.size(); ++k) e_v_[k] = e_v_[k] / hg + a_q.row(k).dot(e_q_);
  system.solve_real(e_v_);
  e_q_ += hg * e_v_;
  e_energy_.noalias() = a_q.lazyProduct(e_q_);
  e_energy_ = e_energy_.cwiseProduct(e_q_).cwiseAbs();
}

double RadauError::in_parts_of(double tolerance, const StepEnds& ends) const {
  const auto n_q = static_cast<double>(e_q_.size()), n_s = static_cast<double>(weights_.size());
  double total = 0;
  for (Eigen::Index k = 0; k < e_q_.size(); ++k) {
    const double size_q = 1 + std::abs(ends.q0[k]), size_v = 1 + std::abs(ends.v0[k]);
    total += e_q_[k] * e_q_[k] / (size_q * size_q) + (e_v_[k] * e_v_[k] + e_energy_[k]) / (size_v * size_v);
  }
  const double scaled = 0.1 * std::pow(tolerance, (n_s + 1.0) / (2.0 * n_s));  // (3)
  return std::sqrt(total / (2 * n_q)) / scaled;
}

}  // namespace ricochet
