#include "methods/contact_laws/bilateral_constraints.h"

#include <algorithm>
#include <cmath>

namespace ricochet {

BilateralConstraints::BilateralConstraints(const Problem& problem) : info_(problem.info()) {
  const int n = info_.n_bilateral();
  G_.setZero(info_.n_q, n);
  WG_.setZero(info_.n_q, n);
  S_.setZero(n, n);
  rates_.setZero(n);
  multipliers_.setZero(n);
}

void BilateralConstraints::set_jacobian(const double* packed_J_n) {
  for (Eigen::Index k = 0; k < G_.cols(); ++k) {
    const auto& contact = info_.contacts[info_.bilateral[k]];
    const double* entry = packed_J_n + contact.normal_begin;
    for (const int row : contact.support) G_(row, k) = *entry++;
  }
}

bool BilateralConstraints::set_delassus() {
  S_.noalias() = G_.transpose().lazyProduct(WG_);
  S_inverse_ = inverse_.of(S_);
  return S_inverse_.allFinite();
}

void BilateralConstraints::impose(Eigen::Ref<Vector> x, const double* b, Eigen::Ref<Vector> m) {
  rates_.noalias() = G_.transpose().lazyProduct(x);
  for (Eigen::Index k = 0; b && k < rates_.size(); ++k) rates_[k] += b[info_.bilateral[k]];
  multipliers_.noalias() = S_inverse_.lazyProduct(rates_);
  x.noalias() -= WG_.lazyProduct(multipliers_);
  for (Eigen::Index k = 0; k < rates_.size(); ++k) m[info_.bilateral[k]] = -multipliers_[k];
}

void BilateralConstraints::velocities(const Vector& x, Vector& rates) const {
  for (Eigen::Index k = 0; k < G_.cols(); ++k) rates[info_.bilateral[k]] = G_.col(k).dot(x);
}

double BilateralConstraints::residual(const Vector& x, const double* b, const Vector& m) const {
  double worst = 0, size = 0;
  for (Eigen::Index k = 0; k < G_.cols(); ++k) {
    const int i = info_.bilateral[k];
    worst = std::max(worst, std::abs(G_.col(k).dot(x) + b[i]));
    size = std::max({size, G_.col(k).cwiseAbs().dot(x.cwiseAbs()) + std::abs(b[i]), std::abs(S_(k, k) * m[i])});
  }
  return size > 0 ? worst / size : 0;
}

}  // namespace ricochet
