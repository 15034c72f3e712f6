#include "methods/control/shooting/convex_hessian.h"

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

/// Terms of the rest up to here are what remains of squares, relative to their size.
constexpr double kRestRounding = 1e-14;

}  // namespace

Matrix positive_part(const Matrix& A) {
  const SymmetricEigen eigen(A);
  const Matrix part = eigen.vectors * eigen.values.cwiseMax(0).asDiagonal() * eigen.vectors.transpose();
  return 0.5 * (part + part.transpose());
}

ConvexHessian::ConvexHessian(const SmoothFunction& cost, const SmoothFunction& residuals)
    : cost_(cost),
      residuals_(residuals),
      rest_(cost.n_inputs(), cost.n_inputs()),
      J_(residuals.n_outputs(), cost.n_inputs()),
      curvature_(cost.n_inputs(), cost.n_inputs()),
      rho_(residuals.n_outputs()) {}

const Matrix& ConvexHessian::at(const double* x) {
  const double one = 1;
  cost_.hessian(x, &one, rest_.data());
  if (rho_.size() > 0) {
    const double size = rest_.lpNorm<Eigen::Infinity>();
    residuals_.evaluate(x, rho_.data());
    residuals_.jacobian(x, J_.data());
    rho_ *= 2;
    residuals_.hessian(x, rho_.data(), curvature_.data());
    rest_ -= curvature_;
    rest_.noalias() -= 2 * J_.transpose() * J_;
    rest_ = (rest_.array().abs() <= kRestRounding * size).select(0, rest_);
  }
  if (of_.rows() != rest_.rows() || of_ != rest_) {
    of_ = rest_;
    part_ = positive_part(rest_);
  }
  if (rho_.size() == 0) return part_;
  result_ = part_;
  result_.noalias() += 2 * J_.transpose() * J_;
  return result_;
}

}  // namespace ricochet
