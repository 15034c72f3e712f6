#include "methods/linear_algebra/band_lu.h"

#include <algorithm>
#include <cmath>

extern "C" {
void dgbtrf_(const int* m, const int* n, const int* kl, const int* ku, double* ab, const int* ldab, int* ipiv,
             int* info);
void dgbtrs_(const char* trans, const int* n, const int* kl, const int* ku, const int* nrhs, const double* ab,
             const int* ldab, const int* ipiv, double* b, const int* ldb, int* info);
}

namespace ricochet {

void BandLu::set_zero(int n, int lower, int upper) {
  n_ = n;
  lower_ = lower;
  upper_ = upper + lower;
  entries_.assign(static_cast<std::size_t>(n) * static_cast<std::size_t>(stride()), 0.0);
  pivots_.resize(static_cast<std::size_t>(n));
}

void BandLu::factorize() {
  const int upper = upper_ - lower_, rows = stride();
  int first_zero_pivot = 0;  // smallest_ says it, too
  dgbtrf_(&n_, &n_, &lower_, &upper, entries_.data(), &rows, pivots_.data(), &first_zero_pivot);
  smallest_ = 1;
  for (int k = 0; k < n_; ++k) {
    double largest = 0;
    for (int i = std::max(0, k - upper_); i <= k; ++i) largest = std::max(largest, std::abs(entry(i, k)));
    smallest_ = largest > 0 ? std::min(smallest_, std::abs(entry(k, k)) / largest) : 0;
  }
}

void BandLu::solve(double* x) const {
  const int upper = upper_ - lower_, rows = stride(), one = 1;
  int ignored = 0;  // tells of bad arguments only
  dgbtrs_("N", &n_, &lower_, &upper, &one, entries_.data(), &rows, pivots_.data(), x, &n_, &ignored);
}

}  // namespace ricochet
