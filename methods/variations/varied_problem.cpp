#include "methods/variations/varied_problem.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/input_error.h"
#include "problems/variables.h"

namespace ricochet {
namespace {

/// Rounding of a derivative of the initial state is a few hundred roundings of its formulas.
constexpr double kConsistency = 1e-13;

}  // namespace

VariedProblem::VariedProblem(const Problem& problem, const std::vector<std::string>& names) : problem_(problem) {
  const ProblemInfo& info = problem.info();
  const int n_q = info.n_q, n_c = info.n_c();
  const auto n_theta = static_cast<Eigen::Index>(names.size());
  const auto n_parameters = static_cast<Eigen::Index>(info.parameters.size());
  parameters_ = Matrix::Zero(n_parameters, n_theta + 1);
  Matrix initial = Matrix::Zero(2 * n_q, n_theta);
  for (Eigen::Index column = 0; column < n_theta; ++column) {
    const auto k = find_variable(info, names[static_cast<std::size_t>(column)]), n = Eigen::Index{info.n_mechanical()};
    (k < n ? initial(k, column) : k < 2 * n ? initial(n_q + k - n, column) : parameters_(k - 2 * n, column)) = 1;
  }
  Matrix constants(2 * n_q + 2 * n_c + 1, n_parameters);
  problem.parameter_derivative_of_constants(constants.data());
  const Matrix varied = constants * parameters_;
  initial += varied.topLeftCorner(2 * n_q, n_theta);
  dq0_ = initial.topRows(n_q);
  dv0_ = initial.bottomRows(n_q);
  deps_r_ = varied.middleRows(2 * n_q, n_c);
  dmu_ = varied.middleRows(2 * n_q + n_c, n_c);
  dt_final_ = varied.bottomLeftCorner(1, n_theta).transpose();
  if (info.has_bilateral()) require_consistent_start(names);
}

VariedProblem VariedProblem::of_step(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  const Eigen::Index n_q = info.n_q, n_theta = 2 * n_q + info.n_u + 1;
  VariedProblem varied(problem);
  varied.parameters_ = Matrix::Zero(static_cast<Eigen::Index>(info.parameters.size()), n_theta + 1);
  varied.control_column_ = 2 * n_q;
  varied.dq0_ = Matrix::Identity(n_q, n_theta);
  varied.dv0_ = Matrix::Zero(n_q, n_theta);
  varied.dv0_.middleCols(n_q, n_q).setIdentity();
  varied.deps_r_ = varied.dmu_ = Matrix::Zero(info.n_c(), n_theta + 1);
  varied.dt_final_ = Vector::Unit(n_theta, n_theta - 1);
  return varied;
}

/// B_u(q). The force is affine in u: a difference over controls as large as the force has its rounding only.
Matrix VariedProblem::input(const Vector& q, const Vector& v) const {
  const Eigen::Index n_u = info().n_u;
  Vector u = Vector::Zero(n_u), f(info().n_q), other(info().n_q);
  problem_.force(q.data(), v.data(), u.data(), f.data());
  const double size = 1 + f.lpNorm<Eigen::Infinity>();
  Matrix B(info().n_q, n_u);
  for (Eigen::Index c = 0; c < n_u; ++c) {
    u[c] = size;
    problem_.force(q.data(), v.data(), u.data(), other.data());
    B.col(c) = (other - f) / size;
    u[c] = 0;
  }
  return B;
}

/// f_c = 0 and J_n' v = 0 at t = 0, varied
void VariedProblem::require_consistent_start(const std::vector<std::string>& names) const {
  const ProblemInfo& info = problem_.info();
  const int n_q = info.n_q;
  const Matrix J_n = problem_.normal_jacobian(info.q0),
               direct =
                   rows(info.q0, info.v0, Vector::Zero(n_q), Vector::Zero(info.n_c()), Vector::Zero(info.n_lambda_t));
  for (const int i : info.bilateral) {
    const Eigen::RowVectorXd J = J_n.col(i).transpose(), curvature = gap_curvature(i, info.q0, info.v0);
    for (Eigen::Index k = 0; k < n_theta(); ++k) {
      const auto is_zero = [](const Eigen::RowVectorXd& slope, const Vector& change, double of_theta) {
        return std::abs(slope.dot(change) + of_theta) <=
               kConsistency * (slope.cwiseAbs().dot(change.cwiseAbs()) + std::abs(of_theta));
      };
      Eigen::RowVectorXd both(2 * n_q);
      Vector change(2 * n_q);
      both << curvature, J;
      change << dq0_.col(k), dv0_.col(k);
      if (!is_zero(J, dq0_.col(k), direct(gap_row(i), k)) || !is_zero(both, change, direct(rate_row(i), k)))
        throw InputError(
            "sensitivity", names[static_cast<std::size_t>(k)],
            fmt::format("it violates the bilateral constraint '{}' at t = 0; the initial state has to vary "
                        "within it, as with parameters that q0 and v0 follow",
                        info.contacts[i].name));
    }
  }
}

Matrix VariedProblem::rows(const Vector& q, const Vector& v, const Vector& a, const Vector& lambda_n,
                           const Vector& lambda_t) const {
  const Eigen::Index n = info().n_q + 2 * info().n_c() + info().n_lambda_t;
  if (control_column_ >= 0) {
    Matrix D = Matrix::Zero(n, parameters_.cols());
    D.block(0, control_column_, info().n_q, info().n_u) = -input(q, v);
    return D;
  }
  if (parameters_.isZero(0)) return Matrix::Zero(n, parameters_.cols());
  Matrix D(n, parameters_.rows());
  problem_.parameter_derivative(q.data(), v.data(), a.data(), lambda_n.data(), lambda_t.data(), D.data());
  return D * parameters_;
}

Eigen::RowVectorXd VariedProblem::deps_r(int contact, double rate) const {
  const auto& of_speed = info().contacts[contact].eps_r_of_speed;
  if (!of_speed) return deps_r_.row(contact);
  Eigen::RowVectorXd d = Eigen::RowVectorXd::Zero(parameters_.rows());
  if (rate < 0 && control_column_ < 0) of_speed->parameter_derivative(-rate, d.data());
  return d * parameters_;
}

Eigen::RowVectorXd VariedProblem::gap_curvature(int contact, const Vector& q, const Vector& v) const {
  const Vector weight = Vector::Unit(info().n_c(), contact);
  Matrix H(info().n_q, info().n_q);
  problem_.gap_hessian(q.data(), weight.data(), H.data());
  return v.transpose() * H;
}

}  // namespace ricochet
