#include "methods/elements/redundant_system.h"

#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

/// Powers of two of the size of the largest entries.
Vector inverse_sizes(const Vector& largest) {
  return largest.unaryExpr([](double x) { return x > 0 && std::isfinite(x) ? std::ldexp(1.0, -std::ilogb(x)) : 1; });
}

struct Scales {
  Vector rows, columns;

  explicit Scales(const Matrix& K)
      : rows(inverse_sizes(K.cwiseAbs().rowwise().maxCoeff())),
        columns(inverse_sizes((rows.asDiagonal() * K).cwiseAbs().colwise().maxCoeff().transpose())) {}

  Matrix of(const Matrix& K) const { return rows.asDiagonal() * K * columns.asDiagonal(); }
};

}  // namespace

bool RedundantSystem::is_singular_in_all_units(const Matrix& K, const Matrix& inverse) {
  const Scales scales(K);
  const Matrix scaled = scales.columns.cwiseInverse().asDiagonal() * inverse * scales.rows.cwiseInverse().asDiagonal();
  const double condition =
      scales.of(K).cwiseAbs().colwise().sum().maxCoeff() * scaled.cwiseAbs().colwise().sum().maxCoeff();
  return !(condition < kSingular);
}

RedundantSystem::RedundantSystem(const Matrix& K, const std::vector<int>& force_rows) {
  const Scales scales(K);
  const RankDecomposition decomposition(scales.of(K), kRank);
  pseudo_inverse_ = scales.columns.asDiagonal() * decomposition.pseudo_inverse * scales.rows.asDiagonal();  // K^-
  to_smallest_.setZero(K.rows(), K.cols());
  if (decomposition.null_space.cols() == 0) return;
  const Matrix N = scales.columns.asDiagonal() * decomposition.null_space;
  const Matrix forces = N(force_rows, Eigen::all);
  to_smallest_(Eigen::all, force_rows) = N * ricochet::pseudo_inverse(forces);
  pseudo_inverse_ -= (to_smallest_ * pseudo_inverse_).eval();
}

}  // namespace ricochet
