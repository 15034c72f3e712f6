#include "methods/elements/stage_coefficients.h"

namespace ricochet {
namespace {

constexpr std::size_t kMaxLengths = 8;

}  // namespace

StageTableau::StageTableau(const ButcherTableau& tableau)
    : ButcherTableau(tableau), ends_with_stage(tableau.is_stiffly_accurate()) {
  A2 = A * A;
  bA = A.transpose() * b;
  rows = A.rowwise().sum();
  if (right_end.size() > 0 && (n_s == 1 || c.maxCoeff() > c.minCoeff())) {
    extrapolation = Matrix::Ones(n_s, n_s);
    for (int j = 0; j < n_s; ++j) {
      for (int k = 0; k < n_s; ++k) {
        for (int m = 0; m < n_s; ++m) {
          if (m != k) extrapolation(j, k) *= (1 + c[j] - c[m]) / (c[k] - c[m]);
        }
      }
    }
  }
}

void StageTableau::extrapolate(const Element& from, Element& to) const {
  if (extrapolation.size() == 0) {
    to.a = from.a;
    to.lambda_n = from.lambda_n;
    to.lambda_t = from.lambda_t;
    return;
  }
  for (int j = 0; j < n_s; ++j) {
    for (Eigen::Index i = 0; i < from.a.rows(); ++i) {
      double a = 0;
      for (int l = 0; l < n_s; ++l) a += extrapolation(j, l) * from.a(i, l);
      to.a(i, j) = a;
    }
  }
  if (from.lambda_n.size() > 0) to.lambda_n.noalias() = from.lambda_n.lazyProduct(extrapolation.transpose());
  if (from.lambda_t.size() > 0) to.lambda_t.noalias() = from.lambda_t.lazyProduct(extrapolation.transpose());
}

void StageCoefficients::set(const StageTableau& tableau, double length) {
  h = length;
  hA = h * tableau.A;
  h2A2 = (h * h) * tableau.A2;
  hb = h * tableau.b;
  h2bA = (h * h) * tableau.bA;
  h_rows = h * tableau.rows;
}

RecentCoefficients::RecentCoefficients(const StageTableau& tableau) : tableau_(tableau) {
  kept_.reserve(kMaxLengths);
}

const StageCoefficients& RecentCoefficients::of(double h) {
  if (last_ < kept_.size() && kept_[last_].h == h) return kept_[last_];
  for (last_ = 0; last_ < kept_.size(); ++last_) {
    if (kept_[last_].h == h) return kept_[last_];
  }
  last_ = oldest_++ % kMaxLengths;
  if (kept_.size() < kMaxLengths) kept_.emplace_back();
  kept_[last_].set(tableau_, h);
  return kept_[last_];
}

}  // namespace ricochet
