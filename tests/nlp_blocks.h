// Blocks to write small programs with.
#pragma once

#include "methods/complementarity/mpcc/nlp.h"

namespace ricochet {

/// c + b'x + x'Q x / 2, a row or a term of the objective.
class QuadraticBlock : public NlpBlock {
 public:
  /// @param row  -1: the objective. @param b  one for each variable, @param Q  symmetric; empty for zero
  QuadraticBlock(int row, std::vector<int> of, double c, Vector b, Matrix Q = {})
      : c_(c), b_(std::move(b)), Q_(std::move(Q)) {
    variables = std::move(of);
    if (row >= 0) rows = {row};
    const auto n = static_cast<Eigen::Index>(variables.size());
    if (Q_.size() == 0) Q_ = Matrix::Zero(n, n);
  }

  void evaluate(const double* x, double* values) const override {
    values[0] = c_ + b_.dot(at(x)) + at(x).dot(Q_ * at(x)) / 2;
  }
  void jacobian(const double* x, double* J) const override { Vector::Map(J, b_.size()) = b_ + Q_ * at(x); }
  void hessian(const double*, const double* weights, double* H) const override {
    Matrix::Map(H, b_.size(), b_.size()) = weights[0] * Q_;
  }

 private:
  Eigen::Map<const Vector> at(const double* x) const { return {x, b_.size()}; }

  double c_;
  Vector b_;
  Matrix Q_;
};

/// sum_k c_k + b_k x_k + a_k x_k^2: the objective of most small problems.
struct Term {
  int variable;
  double b, a = 0;
};
inline void add_terms(Nlp& nlp, int row, double c, const std::vector<Term>& terms) {
  const auto n = static_cast<Eigen::Index>(terms.size());
  std::vector<int> of;
  Vector b(n);
  Matrix Q = Matrix::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    of.push_back(terms[k].variable);
    b[k] = terms[k].b;
    Q(k, k) = 2 * terms[k].a;
  }
  nlp.add_block(std::make_unique<QuadraticBlock>(row, std::move(of), c, std::move(b), std::move(Q)));
}

}  // namespace ricochet
