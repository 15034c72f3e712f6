#pragma once

#include <complex>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// The matrix of a tableau by its eigenvalues,
///
///   A = S diag(l_k) S^-1,   sigma_jk = S_jk (S^-1 e)_k,   e = (1, .., 1)'                                     (1)
///
/// so that (A^p e)_j = sum_k sigma_jk l_k^p for every p. Of a conjugate pair of eigenvalues only one is kept, its sigma
/// is doubled, and of all sums over k the real part counts.
struct DiagonalTableau {
  explicit DiagonalTableau(const Matrix& A);

  /// False if (1) does not hold to rounding, as for triangular A with equal diagonal entries: its eigenvalues coincide.
  bool exists() const { return !l.empty(); }

  std::vector<std::complex<double>> l;  ///< eigenvalues
  Matrix sigma_re, sigma_im;            ///< n_s x eigenvalues
  Vector inverse, inverse2;             ///< n_s: A^-1 e, A^-2 e; empty where A is singular
};

}  // namespace ricochet
