#include "methods/variations/varied_problem.h"

#include <fmt/format.h>

#include <algorithm>
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
  varies_parameters_ = !parameters_.isZero(0);
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

/// -B_u(q), into the columns of the controls. The force is affine in u: a difference over controls as large as the force
/// has its rounding only.
void VariedProblem::subtract_input(const PointOfMotion& at, ScratchPool& pool, Eigen::Ref<Matrix> D) const {
  const ScratchPool::Frame frame(pool);
  const Eigen::Index n_q = info().n_q, n_u = info().n_u;
  VectorMap u = pool.vector(n_u), f = pool.vector(n_q), other = pool.vector(n_q);
  u.setZero();
  problem_.force(at.q.data(), at.v.data(), u.data(), f.data());
  const double size = 1 + f.lpNorm<Eigen::Infinity>();
  for (Eigen::Index c = 0; c < n_u; ++c) {
    u[c] = size;
    problem_.force(at.q.data(), at.v.data(), u.data(), other.data());
    D.col(control_column_ + c).head(n_q) = (f - other) / size;
    u[c] = 0;
  }
}

/// f_c = 0 and J_n' v = 0 at t = 0, varied
void VariedProblem::require_consistent_start(const std::vector<std::string>& names) const {
  const ProblemInfo& info = problem_.info();
  const int n_q = info.n_q;
  const Matrix J_n = problem_.normal_jacobian(info.q0);
  const Vector zero = Vector::Zero(std::max({n_q, info.n_c(), info.n_lambda_t}));
  ScratchPool pool;
  Matrix direct(n_rows(), n_theta());
  rows({info.q0, info.v0, zero.head(n_q), zero.head(info.n_c()), zero.head(info.n_lambda_t)}, pool, direct);
  Vector curvature(n_q);
  for (const int i : info.bilateral) {
    const Eigen::RowVectorXd J = J_n.col(i).transpose();
    gap_curvature(i, info.q0, info.v0, pool, curvature);
    for (Eigen::Index k = 0; k < n_theta(); ++k) {
      const auto is_zero = [](const Eigen::RowVectorXd& slope, const Vector& change, double of_theta) {
        return std::abs(slope.dot(change) + of_theta) <=
               kConsistency * (slope.cwiseAbs().dot(change.cwiseAbs()) + std::abs(of_theta));
      };
      Eigen::RowVectorXd both(2 * n_q);
      Vector change(2 * n_q);
      both << curvature.transpose(), J;
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

void VariedProblem::rows(const PointOfMotion& at, ScratchPool& pool, Eigen::Ref<Matrix> D) const {
  D.setZero();
  if (control_column_ >= 0) subtract_input(at, pool, D);
  if (!varies_parameters_) return;
  const ScratchPool::Frame frame(pool);
  MatrixMap by_parameter = pool.matrix(D.rows(), parameters_.rows());
  problem_.parameter_derivative(at.q.data(), at.v.data(), at.a.data(), at.lambda_n.data(), at.lambda_t.data(),
                                by_parameter.data());
  D.noalias() = by_parameter.lazyProduct(parameters_.leftCols(D.cols()));
}

void VariedProblem::add_deps_r(int contact, double rate, double factor, Eigen::Ref<Eigen::RowVectorXd> sum) const {
  const auto& of_speed = info().contacts[contact].eps_r_of_speed;
  if (!of_speed) {
    sum += factor * deps_r_.row(contact).leftCols(sum.cols());
    return;
  }
  if (rate >= 0 || control_column_ >= 0) return;
  Eigen::RowVectorXd d = Eigen::RowVectorXd::Zero(parameters_.rows());
  of_speed->parameter_derivative(-rate, d.data());
  sum += factor * (d * parameters_.leftCols(sum.cols()));
}

void VariedProblem::gap_curvature(int contact, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v,
                                  ScratchPool& pool, Eigen::Ref<Vector> slope) const {
  slope.setZero();
  if (info().contacts[contact].is_affine) return;
  const ScratchPool::Frame frame(pool);
  VectorMap weight = pool.vector(info().n_c());
  weight.setZero();
  weight[contact] = 1;
  MatrixMap H = pool.matrix(info().n_q, info().n_q);
  problem_.gap_hessian(q.data(), weight.data(), H.data());
  slope.noalias() = H.lazyProduct(v);  // H is symmetric
}

}  // namespace ricochet
