#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "methods/complementarity/mpcc/nlp.h"
#include "problems/derivatives/smooth_function.h"

namespace ricochet {

// The kinds of blocks that a transcription is made of.

/// f(x). The function is shared by many blocks and has to outlive them.
class FunctionBlock final : public NlpBlock {
 public:
  /// @param its_variables  one per input of f; @param its_rows  one per output; empty: f has one, a term of the
  /// objective
  FunctionBlock(const SmoothFunction& function, std::vector<int> its_variables, std::vector<int> its_rows)
      : function_(function) {
    variables = std::move(its_variables);
    rows = std::move(its_rows);
    if (static_cast<int>(variables.size()) != function.n_inputs())
      throw std::logic_error(
          fmt::format("a function of {} inputs got {} variables", function.n_inputs(), variables.size()));
  }

  void evaluate(const double* x, double* values) const override { function_.evaluate(x, values); }
  void jacobian(const double* x, double* J) const override { function_.jacobian(x, J); }
  void hessian(const double* x, const double* weights, double* H) const override { function_.hessian(x, weights, H); }

 private:
  const SmoothFunction& function_;
};

/// One row: sum_k c_k x_k.
class LinearBlock final : public NlpBlock {
 public:
  LinearBlock(int row, const std::vector<std::pair<int, double>>& terms) {
    rows = {row};
    for (const auto& [variable, coefficient] : terms) {
      variables.push_back(variable);
      coefficients_.push_back(coefficient);
    }
  }

  void evaluate(const double* x, double* values) const override {
    values[0] = 0;
    for (std::size_t k = 0; k < variables.size(); ++k) values[0] += coefficients_[k] * x[k];
  }
  void jacobian(const double*, double* J) const override {
    for (std::size_t k = 0; k < variables.size(); ++k) J[k] = coefficients_[k];
  }
  void hessian(const double*, const double*, double*) const override {}

 private:
  std::vector<double> coefficients_;
};

/// A term of the objective: weight (sum_k c_k x_k)^2.
class SquareBlock final : public NlpBlock {
 public:
  SquareBlock(double weight, const std::vector<std::pair<int, double>>& terms) : weight_(weight) {
    for (const auto& [variable, coefficient] : terms) {
      variables.push_back(variable);
      coefficients_.push_back(coefficient);
    }
  }

  void evaluate(const double* x, double* values) const override { values[0] = weight_ * sum(x) * sum(x); }
  void jacobian(const double* x, double* J) const override {
    for (std::size_t k = 0; k < variables.size(); ++k) J[k] = 2 * weight_ * sum(x) * coefficients_[k];
  }
  void hessian(const double*, const double* weights, double* H) const override {
    const std::size_t n = variables.size();
    for (std::size_t c = 0; c < n; ++c) {
      for (std::size_t r = 0; r < n; ++r) H[c * n + r] = 2 * weights[0] * weight_ * coefficients_[r] * coefficients_[c];
    }
  }

 private:
  double sum(const double* x) const {
    double total = 0;
    for (std::size_t k = 0; k < variables.size(); ++k) total += coefficients_[k] * x[k];
    return total;
  }

  const double weight_;
  std::vector<double> coefficients_;
};

/// A term of the objective: b h f(x), the contribution of a stage to an integral. Variables: h, then those of f.
class QuadratureBlock final : public NlpBlock {
 public:
  QuadratureBlock(const SmoothFunction& integrand, double b, int h, const std::vector<int>& arguments)
      : integrand_(integrand), b_(b) {
    variables = {h};
    variables.insert(variables.end(), arguments.begin(), arguments.end());
  }

  void evaluate(const double* x, double* values) const override {
    integrand_.evaluate(x + 1, values);
    values[0] *= b_ * x[0];
  }
  void jacobian(const double* x, double* J) const override {
    integrand_.evaluate(x + 1, J);
    J[0] *= b_;
    integrand_.jacobian(x + 1, J + 1);
    for (std::size_t k = 1; k < variables.size(); ++k) J[k] *= b_ * x[0];
  }
  /// H is its own room: the curvature of f is written packed after the column of h, and spread from its end on.
  void hessian(const double* x, const double* weights, double* H) const override {
    const std::size_t n = variables.size();
    integrand_.hessian(x + 1, weights, H + n);
    for (std::size_t c = n - 1; c > 0; --c) {
      for (std::size_t r = n - 1; r > 0; --r) {
        double& packed = H[n + (c - 1) * (n - 1) + r - 1];
        const double value = b_ * x[0] * packed;
        packed = 0;
        H[c * n + r] = value;
      }
    }
    integrand_.jacobian(x + 1, H + 1);
    for (std::size_t k = 1; k < n; ++k) {
      H[k] *= weights[0] * b_;
      H[k * n] = H[k];
    }
  }

 private:
  const SmoothFunction& integrand_;
  const double b_;
};

}  // namespace ricochet
