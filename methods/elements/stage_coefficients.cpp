#include "methods/elements/stage_coefficients.h"

#include <array>

namespace ricochet {
namespace {

constexpr std::size_t kMaxLengths = 8;
constexpr int kMaxStages = 9;  // of an element whose stages are continued to another length

/// Weights of stage values at begin + length c_j: Lagrange's polynomials. @param weights  n_s x n_s, column by column
void set_weights(const StageTableau& tableau, double begin, double length, double* weights) {
  const int n_s = tableau.n_s;
  for (int j = 0; j < n_s; ++j) {
    const double x = begin + length * tableau.c[j];
    for (int k = 0; k < n_s; ++k) {
      double weight = tableau.node_weights[k];
      for (int m = 0; m < n_s; ++m) weight *= m == k ? 1 : x - tableau.c[m];
      weights[k * n_s + j] = weight;
    }
  }
}

}  // namespace

StageTableau::StageTableau(const ButcherTableau& tableau)
    : ButcherTableau(tableau), ends_with_stage(tableau.is_stiffly_accurate()) {
  A2 = A * A;
  bA = A.transpose() * b;
  rows = A.rowwise().sum();
  has_polynomial = right_end.size() > 0 && (n_s == 1 || c.maxCoeff() > c.minCoeff());
  if (!has_polynomial) return;
  node_weights.setOnes(n_s);
  for (int k = 0; k < n_s; ++k) {
    for (int m = 0; m < n_s; ++m) {
      if (m != k) node_weights[k] /= c[k] - c[m];
    }
  }
  extrapolation.resize(n_s, n_s);
  set_weights(*this, 1, 1, extrapolation.data());
}

/// Stage values of `from` by the rows of weights.
void StageTableau::combine(const double* weights, const Element& from, Element& to) const {
  const auto apply = [&](const Matrix& values, Matrix& result) {
    const Eigen::Index n = values.rows();
    for (int j = 0; j < n_s; ++j) {
      for (Eigen::Index i = 0; i < n; ++i) {
        double sum = 0;
        for (int l = 0; l < n_s; ++l) sum += weights[l * n_s + j] * values(i, l);
        result(i, j) = sum;
      }
    }
  };
  apply(from.a, to.a);
  apply(from.lambda_n, to.lambda_n);
  apply(from.lambda_t, to.lambda_t);
}

void StageTableau::extrapolate(const Element& from, Element& to) const {
  if (has_polynomial) return combine(extrapolation.data(), from, to);
  to.a = from.a;
  to.lambda_n = from.lambda_n;
  to.lambda_t = from.lambda_t;
}

void StageTableau::continue_stages(const Element& from, double begin, double length, Element& to) const {
  if (!has_polynomial || n_s > kMaxStages) return extrapolate(from, to);
  std::array<double, kMaxStages * kMaxStages> weights;
  set_weights(*this, begin, length, weights.data());
  combine(weights.data(), from, to);
}

void StageCoefficients::set(const StageTableau& tableau, double length) {
  h = length;
  if (values_.empty()) {
    const Eigen::Index n = tableau.n_s;
    values_.resize(static_cast<std::size_t>(n * (2 * n + 3)));
    double* at = values_.data();
    for (auto* matrix : {&hA, &h2A2}) {
      new (matrix) Eigen::Map<RowMajorMatrix>(at, n, n);  // as Eigen says how to move a map
      at += n * n;
    }
    for (auto* vector : {&hb, &h2bA, &h_rows}) {
      new (vector) Eigen::Map<Vector>(at, n);
      at += n;
    }
  }
  hA = h * tableau.A;
  h2A2 = (h * h) * tableau.A2;
  hb = h * tableau.b;
  h2bA = (h * h) * tableau.bA;
  h_rows = h * tableau.rows;
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
