#include "reference/force_equations.h"

#include "problems/dense_solve.h"

namespace ricochet::reference {
namespace {

// Largest motion by a null vector that counts as zero, relative to that by its components: above the square root of
// kSingular.
constexpr double kNoMotion = 1e-5;

}  // namespace

ForceEquations::ForceEquations(const Matrix& A, const Vector& diagonal, Singular singular)
    : s_(diagonal.cwiseSqrt().cwiseInverse()), A_(s_.asDiagonal() * A * s_.asDiagonal()), lu_(A_, kSingular) {
  null_space_.resize(A.rows(), 0);
  if (lu_.is_invertible() || singular == Singular::refuse) return;
  const SingularValues svd(A_);
  const Eigen::Index rank = lu_.rank();
  pseudo_inverse_ =
      svd.V.leftCols(rank) * svd.values.head(rank).cwiseInverse().asDiagonal() * svd.U.leftCols(rank).transpose();
  null_space_ = s_.asDiagonal() * svd.V.rightCols(A.cols() - rank);
}

std::optional<Vector> ForceEquations::solve(const Vector& b, const Vector& b_size) const {
  const Vector right = s_.cwiseProduct(b);
  if (lu_.is_invertible()) return s_.cwiseProduct(lu_.solve(right));
  if (null_space_.cols() == 0) return std::nullopt;
  const Vector x = pseudo_inverse_ * right;
  const double size = s_.cwiseProduct(b_size).maxCoeff() + (A_.cwiseAbs() * x.cwiseAbs()).maxCoeff();
  if ((A_ * x - right).cwiseAbs().maxCoeff() > 10 * kLawRounding * size) return std::nullopt;
  return s_.cwiseProduct(x);
}

bool ForceEquations::determines(Eigen::Index r) const {
  return null_space_.cols() == 0 || null_space_.row(r).norm() <= kNoMotion * s_[r];
}

bool ForceEquations::determines_motion(const Matrix& effect) const {
  return null_space_.cols() == 0 || (effect * null_space_).cwiseAbs().maxCoeff() <= kNoMotion;
}

}  // namespace ricochet::reference
