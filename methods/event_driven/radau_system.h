#pragma once

#include <vector>

#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/small_complex.h"

namespace ricochet {

/// The linear system of simplified Newton iterations of Radau IIA, n_q unknowns per stage,
///
///   (h^-1 A^-1 x I - I x a_v - h A x a_q) dw = r                                         (1)
///
/// by the eigenvalues l of A: with dw = T y, A = T diag(l) T^-1,
///
///   (I / (h l) - a_v - h l a_q) y = (T^-1 x I) r                                         (2)
///
/// for the real l and one of each pair.
class RadauSystem {
 public:
  /// @param tableau  Radau IIA with an odd number of stages
  RadauSystem(const ButcherTableau& tableau, int n_q);

  /// The matrices of (2) for a step of length h [s]. @return false where one is singular
  bool factorize(double h, const Matrix& a_q, const Matrix& a_v);
  void forget() { h_ = 0; }
  double h() const { return h_; }  ///< [s], of the factors; 0: there are none
  int n_factors() const { return static_cast<int>(modes_.size()); }

  /// (1). @param r, dw  n_q x n_s
  void solve(const Matrix& r, Matrix& dw);
  /// (2) of the real eigenvalue, x in and out.
  void solve_real(Vector& x);
  double real_eigenvalue() const { return modes_[real_].l.re; }

 private:
  /// An eigenvalue of A with its column of T, doubled where it stands for a pair, and its row of T^-1; (2) for it.
  struct Mode {
    Complex l;
    std::vector<Complex> column, inverse_row;  // n_s
    ComplexFactors factors;
  };

  const int n_q_, n_s_;
  std::vector<Mode> modes_;
  std::size_t real_ = 0;    // of modes_: the real one
  std::vector<Complex> y_;  // n_q
  double h_ = 0;
};

}  // namespace ricochet
