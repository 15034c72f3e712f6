#include "methods/runge_kutta/diagonal_tableau.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace ricochet {
namespace {

using LongReal = long double;  // the eigenvectors of many stages lose digits
using RealMatrix = Eigen::Matrix<LongReal, Eigen::Dynamic, Eigen::Dynamic>;
using ComplexMatrix = Eigen::Matrix<std::complex<LongReal>, Eigen::Dynamic, Eigen::Dynamic>;

// Largest |sigma_jk|, an upper limit of the cancellation in sums over k: two digits of an acceleration.
constexpr double kMaxSigma = 1e4;
// Largest residual of (1).
constexpr double kResidual = 1e-15;
constexpr double kSingular = 1e-12;  // an eigenvalue up to this is zero

}  // namespace

DiagonalTableau::DiagonalTableau(const Matrix& matrix) {
  const auto n = matrix.rows();
  const RealMatrix A = matrix.cast<LongReal>();
  const Eigen::EigenSolver<RealMatrix> solver(A);
  if (solver.info() != Eigen::Success) return;
  const ComplexMatrix S = solver.eigenvectors();
  const Eigen::Matrix<std::complex<LongReal>, Eigen::Dynamic, 1> values = solver.eigenvalues(),
                                                                 part =
                                                                     S.partialPivLu().solve(ComplexMatrix::Ones(n, 1));
  const ComplexMatrix sigma = S * part.asDiagonal();
  const bool is_diagonal =
      sigma.allFinite() && sigma.cwiseAbs().maxCoeff() <= kMaxSigma &&
      (sigma.rowwise().sum() - ComplexMatrix::Ones(n, 1)).cwiseAbs().maxCoeff() <= kResidual &&
      (A.cast<std::complex<LongReal>>() * sigma - sigma * values.asDiagonal()).cwiseAbs().maxCoeff() <= kResidual;
  if (!is_diagonal) return;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (values[k].imag() >= 0) kept.push_back(k);
  }
  const auto n_kept = static_cast<Eigen::Index>(kept.size());
  sigma_re.resize(n, n_kept);
  sigma_im.resize(n, n_kept);
  bool is_regular = true;
  for (Eigen::Index m = 0; m < n_kept; ++m) {
    const Eigen::Index k = kept[static_cast<std::size_t>(m)];
    const LongReal weight = values[k].imag() > 0 ? 2 : 1;
    l.emplace_back(static_cast<double>(values[k].real()), static_cast<double>(values[k].imag()));
    sigma_re.col(m) = (weight * sigma.col(k).real()).cast<double>();
    sigma_im.col(m) = (weight * sigma.col(k).imag()).cast<double>();
    is_regular = is_regular && std::abs(values[k]) > kSingular;
  }
  if (!is_regular) return;
  const Eigen::PartialPivLU<RealMatrix> lu(A);
  const RealMatrix once = lu.solve(RealMatrix::Ones(n, 1)), twice = lu.solve(once);
  inverse = once.cast<double>();
  inverse2 = twice.cast<double>();
}

}  // namespace ricochet
