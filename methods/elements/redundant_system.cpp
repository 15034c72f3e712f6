#include "methods/elements/redundant_system.h"

#include <Eigen/QR>

#include "problems/dense_solve.h"

namespace ricochet {

RedundantSystem::RedundantSystem(const Matrix& K, const std::vector<int>& force_rows) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition(K.rows(), K.cols());
  decomposition.setThreshold(kRank);
  decomposition.compute(K);
  pseudo_inverse_ = decomposition.pseudoInverse();
  const Eigen::Index nullity = K.cols() - decomposition.rank();
  to_smallest_.setZero(K.rows(), K.cols());
  if (nullity == 0) return;
  Matrix N = Matrix::Zero(K.cols(), nullity);
  N.bottomRows(nullity).setIdentity();
  N = decomposition.colsPermutation() * (decomposition.matrixZ().transpose() * N).eval();
  const Matrix forces = N(force_rows, Eigen::all);
  to_smallest_(Eigen::all, force_rows) = N * ricochet::pseudo_inverse(forces);
}

}  // namespace ricochet
