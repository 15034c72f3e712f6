#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// A complex number without the checks for infinities of every product of std::complex.
struct Complex {
  double re = 0, im = 0;

  friend Complex operator*(Complex a, Complex b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
  friend Complex operator*(double a, Complex b) { return {a * b.re, a * b.im}; }
  friend Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
  friend Complex operator-(Complex a, Complex b) { return {a.re - b.re, a.im - b.im}; }
  Complex inverse() const {
    const double scale = 1 / (re * re + im * im);
    return {re * scale, -im * scale};
  }
  double size() const { return std::abs(re) + std::abs(im); }
};

/// A = P' L U, with row exchanges by the largest entry of a column.
class ComplexFactors {
 public:
  explicit ComplexFactors(int n) : n_(n), LU_(static_cast<std::size_t>(n) * n), rows_(n) {}

  /// The matrix, row after row, which compute() replaces by its factors.
  Complex& operator()(int i, int k) { return LU_[static_cast<std::size_t>(i) * n_ + k]; }

  /// False when a column has no pivot.
  bool compute() {
    for (int k = 0; k < n_; ++k) {
      int pivot = k;
      for (int i = k + 1; i < n_; ++i) {
        if (row(i)[k].size() > row(pivot)[k].size()) pivot = i;
      }
      rows_[k] = pivot;
      if (!(row(pivot)[k].size() > 0)) return false;
      if (pivot != k) std::swap_ranges(row(k), row(k) + n_, row(pivot));
      row(k)[k] = row(k)[k].inverse();
      for (int i = k + 1; i < n_; ++i) {
        const Complex factor = row(i)[k] = row(i)[k] * row(k)[k];
        for (int c = k + 1; c < n_; ++c) row(i)[c] = row(i)[c] - factor * row(k)[c];
      }
    }
    return true;
  }

  /// x <- A^-1 x. @param x  n
  void solve(Complex* x) const {
    for (int k = 0; k < n_; ++k) std::swap(x[k], x[rows_[k]]);
    for (int i = 1; i < n_; ++i) {
      for (int k = 0; k < i; ++k) x[i] = x[i] - row(i)[k] * x[k];
    }
    for (int i = n_ - 1; i >= 0; --i) {
      for (int k = i + 1; k < n_; ++k) x[i] = x[i] - row(i)[k] * x[k];
      x[i] = row(i)[i] * x[i];
    }
  }

 private:
  Complex* row(int i) { return LU_.data() + static_cast<std::size_t>(i) * n_; }
  const Complex* row(int i) const { return LU_.data() + static_cast<std::size_t>(i) * n_; }

  int n_;
  std::vector<Complex> LU_;  // pivots inverse
  std::vector<int> rows_;    // exchanged with k in step k
};

}  // namespace ricochet
