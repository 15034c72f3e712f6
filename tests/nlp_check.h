// Derivatives of a nonlinear program, held against differences.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "methods/complementarity/mpcc/nlp_evaluator.h"

namespace ricochet {

/// The matrix of the values at the pattern; symmetric when they are a lower triangle.
inline Matrix dense(const SparsityPattern& pattern, const Vector& values, int n_rows, int n_columns, bool symmetric) {
  Matrix A = Matrix::Zero(n_rows, n_columns);
  for (int k = 0; k < pattern.size(); ++k) {
    A(pattern.rows[k], pattern.columns[k]) += values[k];
    if (symmetric && pattern.rows[k] != pattern.columns[k]) A(pattern.columns[k], pattern.rows[k]) += values[k];
  }
  return A;
}

/// Expects gradient, Jacobian and Hessian of the Lagrangian as `NlpEvaluator` assembles them to be the central
/// differences of objective, rows and their gradients.
/// @param x       n_variables, at least one step inside of where the functions are smooth
/// @param lambda  n_rows
/// @param tolerance  relative to 1 + |entry|: a difference is exact to about (1e-16)^(2/3) times the curvature
inline void expect_derivatives(const Nlp& nlp, const Vector& x, const Vector& lambda, double tolerance = 1e-7) {
  NlpEvaluator evaluator(nlp);
  const int n = nlp.n_variables(), m = nlp.n_rows();
  const double weight = 0.7;  // of the objective
  const auto gradient = [&](const Vector& at) {
    Vector values(n);
    evaluator.gradient(at.data(), values.data());
    return values;
  };
  const auto rows = [&](const Vector& at) {
    Vector values(m);
    evaluator.constraints(at.data(), values.data());
    return values;
  };
  const auto jacobian = [&](const Vector& at) {
    Vector values(evaluator.jacobian_pattern().size());
    evaluator.jacobian(at.data(), values.data());
    return dense(evaluator.jacobian_pattern(), values, m, n, false);
  };
  Vector values(evaluator.hessian_pattern().size());
  evaluator.hessian(x.data(), weight, lambda.data(), values.data());
  const Matrix hessian = dense(evaluator.hessian_pattern(), values, n, n, true);
  const Matrix J = jacobian(x);
  const Vector f = gradient(x);

  const auto expect_near = [&](double analytic, double difference, const std::string& what) {
    EXPECT_NEAR(analytic, difference, tolerance * (1 + std::abs(analytic))) << what;
  };
  for (int k = 0; k < n; ++k) {
    const std::string& by = nlp.variables[k].name;
    const double h = 6e-6 * std::max(1.0, std::abs(x[k]));  // 1e-16^(1/3)
    Vector plus = x, minus = x;
    plus[k] += h;
    minus[k] -= h;
    expect_near(f[k], (evaluator.objective(plus.data()) - evaluator.objective(minus.data())) / (2 * h),
                "objective by " + by);
    const Vector d_rows = (rows(plus) - rows(minus)) / (2 * h);
    for (int i = 0; i < m; ++i) expect_near(J(i, k), d_rows[i], "row " + nlp.rows[i].name + " by " + by);
    const Vector column =
        (weight * (gradient(plus) - gradient(minus)) + (jacobian(plus) - jacobian(minus)).transpose() * lambda) /
        (2 * h);
    for (int l = 0; l < n; ++l)
      expect_near(hessian(l, k), column[l], "Lagrangian by " + nlp.variables[l].name + ", " + by);
  }
}

}  // namespace ricochet
