#include "methods/event_driven/radau_system.h"

#include <utility>

#include "methods/runge_kutta/diagonal_tableau.h"
#include "problems/dense_solve.h"

namespace ricochet {

RadauSystem::RadauSystem(const ButcherTableau& tableau, int n_q)
    : n_q_(n_q), n_s_(tableau.n_s), y_(static_cast<std::size_t>(n_q)) {
  // T y = sum Re(sigma y) is real in the real and imaginary parts of y.
  const DiagonalTableau diagonal(tableau.A);
  Matrix T(n_s_, n_s_);
  Eigen::Index column = 0;
  for (std::size_t m = 0; m < diagonal.l.size(); ++m) {
    const auto at = static_cast<Eigen::Index>(m);
    T.col(column++) = diagonal.sigma_re.col(at);
    if (diagonal.l[m].imag() != 0) T.col(column++) = -diagonal.sigma_im.col(at);
  }
  const Matrix T_inverse = solve_partial_pivoting(T, Matrix::Identity(n_s_, n_s_));
  column = 0;
  for (std::size_t m = 0; m < diagonal.l.size(); ++m) {
    const auto at = static_cast<Eigen::Index>(m);
    const bool is_real = diagonal.l[m].imag() == 0;
    Mode mode{{diagonal.l[m].real(), diagonal.l[m].imag()}, {}, {}, ComplexFactors(n_q)};
    for (int i = 0; i < n_s_; ++i) {
      mode.column.push_back({diagonal.sigma_re(i, at), is_real ? 0 : diagonal.sigma_im(i, at)});
      mode.inverse_row.push_back({T_inverse(column, i), is_real ? 0 : T_inverse(column + 1, i)});
    }
    column += is_real ? 1 : 2;
    if (is_real) real_ = m;
    modes_.push_back(std::move(mode));
  }
}

bool RadauSystem::factorize(double h, const Matrix& a_q, const Matrix& a_v) {
  h_ = 0;
  for (Mode& mode : modes_) {
    const Complex hl = h * mode.l, inverse = hl.inverse();
    for (int i = 0; i < n_q_; ++i) {
      for (int k = 0; k < n_q_; ++k) mode.factors(i, k) = {-a_v(i, k) - hl.re * a_q(i, k), -hl.im * a_q(i, k)};
      mode.factors(i, i) = mode.factors(i, i) + inverse;
    }
    if (!mode.factors.compute()) return false;
  }
  h_ = h;
  return true;
}

void RadauSystem::solve(const Matrix& r, Matrix& dw) {
  dw.setZero();
  for (const Mode& mode : modes_) {
    for (Eigen::Index k = 0; k < n_q_; ++k) {
      Complex sum;
      for (int i = 0; i < n_s_; ++i) sum = sum + r(k, i) * mode.inverse_row[i];
      y_[k] = sum;
    }
    mode.factors.solve(y_.data());
    for (int i = 0; i < n_s_; ++i) {
      for (Eigen::Index k = 0; k < n_q_; ++k) dw(k, i) += (mode.column[i] * y_[k]).re;
    }
  }
}

void RadauSystem::solve_real(Vector& x) {
  for (Eigen::Index k = 0; k < n_q_; ++k) y_[k] = {x[k], 0};
  modes_[real_].factors.solve(y_.data());
  for (Eigen::Index k = 0; k < n_q_; ++k) x[k] = y_[k].re;
}

}  // namespace ricochet
