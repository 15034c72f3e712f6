#include "methods/event_driven/radau_step.h"

#include <algorithm>
#include <cmath>

#include "methods/runge_kutta/diagonal_tableau.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 10;
constexpr double kKeptContraction = 1e-3;  // up to which the Jacobian is kept
constexpr double kNewton = 0.01;           // of the tolerance
constexpr double kRounding = 1e-15;        // relative: corrections cannot become smaller
constexpr double kKeptGrowth = 1.2;        // of RADAU

Matrix inverse(const Matrix& A) {
  return solve_partial_pivoting(A, Matrix::Identity(A.rows(), A.cols()));
}

}  // namespace

RadauStep::RadauStep(const ButcherTableau& tableau, int n_q, ModeDynamics& dynamics)
    : n_q_(n_q),
      n_s_(tableau.n_s),
      dynamics_(dynamics),
      c_(tableau.c),
      A_transposed_(tableau.A.transpose()),
      A_inverse_transposed_(inverse(tableau.A).transpose()),
      y_(static_cast<std::size_t>(n_q)),
      polynomial_(tableau.c, n_q),
      last_polynomial_(tableau.c, n_q) {
  ends.resize(n_q);
  order = tableau.order;
  error_order = n_s_;
  kept_growth = kKeptGrowth;

  // T y = sum Re(sigma y) is real in the real and imaginary parts of y.
  const DiagonalTableau diagonal(tableau.A);
  Matrix T(n_s_, n_s_);
  Eigen::Index column = 0;
  for (std::size_t m = 0; m < diagonal.l.size(); ++m) {
    const auto at = static_cast<Eigen::Index>(m);
    T.col(column++) = diagonal.sigma_re.col(at);
    if (diagonal.l[m].imag() != 0) T.col(column++) = -diagonal.sigma_im.col(at);
  }
  const Matrix T_inverse = inverse(T);
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
    if (is_real) {
      real_ = m;
      g_ = mode.l.re;
    }
    modes_.push_back(std::move(mode));
  }

  // (5)
  Matrix powers = Matrix::Ones(n_s_, n_s_);
  for (Eigen::Index k = 1; k < n_s_; ++k) powers.row(k) = powers.row(k - 1).cwiseProduct(c_.transpose());
  weights_ = A_inverse_transposed_ * (-g_ * inverse(powers).col(0));

  for (auto* x : {&w_, &q_, &a_, &residual_, &correction_, &moved_}) x->setZero(n_q, n_s_);
  for (auto* x : {&stage_v_, &e_q_, &e_v_, &e_energy_, &last_v0_, &last_a0_, &last_v1_, &last_a1_}) x->setZero(n_q);
  a_q_.setZero(n_q, n_q);
  a_v_.setZero(n_q, n_q);
}

void RadauStep::start(double tolerance) {
  tolerance_ = tolerance;
  is_linear_ = is_fresh_ = false;
  contraction_ = left_ = 1;
  last_h_ = 0;
}

bool RadauStep::take(double h, EventFunctions* watched) {
  ends.h = h;
  ends.collocation = &polynomial_;
  if (mode_changes_ != dynamics_.mode_changes()) is_linear_ = is_fresh_ = false, last_h_ = 0;
  const bool is_kept = is_linear_ && (is_fresh_ || contraction_ <= kKeptContraction);
  if (!is_kept && !linearize()) return false;
  if (h != h_factors_ && !factorize()) return false;
  predict();
  if (!iterate()) {
    if (is_fresh_ || !linearize() || !factorize()) return false;
    predict();
    if (!iterate()) return false;
  }
  ends.q1 = q_.col(n_s_ - 1);
  ends.v1 = ends.v0 + w_.col(n_s_ - 1);
  polynomial_.set(ends.h, w_);
  estimate();
  for (int i = 0; watched && i + 1 < n_s_; ++i) {
    stage_v_ = ends.v0 + w_.col(i);
    if (!dynamics_.accelerate(q_.col(i).data(), stage_v_.data(), a_.col(i).data())) return false;
    watched->record_stage(c_[i]);
  }
  return true;
}

bool RadauStep::finish() {
  if (!dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data())) return false;
  last_polynomial_ = polynomial_;
  last_h_ = ends.h;
  last_v0_ = ends.v0;
  last_a0_ = ends.a0;
  last_v1_ = ends.v1;
  last_a1_ = ends.a1;
  is_fresh_ = false;
  return true;
}

/// a_q and a_v at the left end.
bool RadauStep::linearize() {
  if (!dynamics_.acceleration_jacobians(ends.q0, ends.v0, ends.a0, a_q_, a_v_)) return false;
  mode_changes_ = dynamics_.mode_changes();
  is_linear_ = is_fresh_ = true;
  contraction_ = left_ = 1;
  h_factors_ = 0;
  return true;
}

/// The matrices of (3).
bool RadauStep::factorize() {
  h_factors_ = 0;
  for (Mode& mode : modes_) {
    const Complex hl = ends.h * mode.l, inverse = hl.inverse();
    for (int i = 0; i < n_q_; ++i) {
      for (int k = 0; k < n_q_; ++k) {
        mode.factors(i, k) = {-a_v_(i, k) - hl.re * a_q_(i, k), -hl.im * a_q_(i, k)};
      }
      mode.factors(i, i) = mode.factors(i, i) + inverse;
    }
    if (!mode.factors.compute()) return false;
  }
  h_factors_ = ends.h;
  dynamics_.counters().matrix_factorizations += static_cast<std::int64_t>(modes_.size());
  return true;
}

/// The polynomial of the last step, where this one begins at either of its ends.
void RadauStep::predict() {
  const bool from_left = last_h_ > 0 && last_v0_ == ends.v0 && last_a0_ == ends.a0;
  const bool from_right = last_h_ > 0 && last_v1_ == ends.v0 && last_a1_ == ends.a0;
  for (int i = 0; i < n_s_; ++i) {
    if (!from_left && !from_right) {
      w_.col(i) = ends.h * c_[i] * ends.a0;
      continue;
    }
    const double s = (from_left ? 0 : 1) + c_[i] * ends.h / last_h_;
    for (Eigen::Index k = 0; k < n_q_; ++k) {
      w_(k, i) = last_polynomial_.velocity(k, s) - (from_left ? 0 : last_polynomial_.velocity(k, 1));
    }
  }
}

/// (1)
void RadauStep::set_positions() {
  q_.noalias() = w_.lazyProduct(A_transposed_);
  for (int i = 0; i < n_s_; ++i) q_.col(i) = ends.q0 + ends.h * (c_[i] * ends.v0 + q_.col(i));
}

/// a of all stages.
bool RadauStep::set_accelerations() {
  for (int i = 0; i < n_s_; ++i) {
    stage_v_ = ends.v0 + w_.col(i);
    if (!dynamics_.accelerate(q_.col(i).data(), stage_v_.data(), a_.col(i).data())) return false;
  }
  return a_.allFinite();
}

bool RadauStep::iterate() {
  set_positions();
  left_ = std::pow(std::max(left_, kRounding), 0.8);
  double last = 0;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    if (!set_accelerations()) return false;
    const double size = correct();
    ++dynamics_.counters().inner_iterations;
    if (!std::isfinite(size)) return false;
    if (size <= kRounding) return true;
    if (iteration > 0) {
      contraction_ = size / last;
      if (contraction_ >= 1) return size <= kNewton * tolerance_;
      left_ = contraction_ / (1 - contraction_);
    }
    if (left_ * size <= kNewton * tolerance_) return true;
    last = size;
  }
  return false;
}

/// (3). @return the root mean square of the correction of (q, v), of 1 + |x|
double RadauStep::correct() {
  residual_.noalias() = w_.lazyProduct(A_inverse_transposed_);
  residual_ = a_ - residual_ / ends.h;
  correction_.setZero();
  for (const Mode& mode : modes_) {
    for (Eigen::Index k = 0; k < n_q_; ++k) {
      Complex sum;
      for (int i = 0; i < n_s_; ++i) sum = sum + residual_(k, i) * mode.inverse_row[i];
      y_[k] = sum;
    }
    mode.factors.solve(y_.data());
    for (int i = 0; i < n_s_; ++i) {
      for (Eigen::Index k = 0; k < n_q_; ++k) correction_(k, i) += (mode.column[i] * y_[k]).re;
    }
  }
  dynamics_.counters().linear_solves += static_cast<std::int64_t>(modes_.size());
  w_ += correction_;
  moved_.noalias() = ends.h * correction_.lazyProduct(A_transposed_);
  q_ += moved_;
  double total = 0;
  for (int i = 0; i < n_s_; ++i) {
    for (Eigen::Index k = 0; k < n_q_; ++k) {
      const double q = moved_(k, i) / (1 + std::abs(ends.q0[k])), v = correction_(k, i) / (1 + std::abs(ends.v0[k]));
      total += q * q + v * v;
    }
  }
  return std::sqrt(total / (2 * n_q_ * n_s_));
}

/// (4) and the squares of (7)
void RadauStep::estimate() {
  const double hg = ends.h * g_;
  e_q_ = hg * ends.v0;
  e_v_ = hg * ends.a0;
  for (int i = 0; i < n_s_; ++i) {
    e_q_ += weights_[i] * (q_.col(i) - ends.q0);
    e_v_ += weights_[i] * w_.col(i);
  }
  for (Eigen::Index k = 0; k < n_q_; ++k) y_[k] = {e_v_[k] / hg + a_q_.row(k).dot(e_q_), 0};
  modes_[real_].factors.solve(y_.data());
  for (Eigen::Index k = 0; k < n_q_; ++k) e_v_[k] = y_[k].re;
  e_q_ += hg * e_v_;
  e_energy_.noalias() = a_q_.lazyProduct(e_q_);
  e_energy_ = e_energy_.cwiseProduct(e_q_).cwiseAbs();
}

double RadauStep::error(double tolerance) const {
  double total = 0;
  for (Eigen::Index k = 0; k < n_q_; ++k) {
    const double size_q = 1 + std::abs(ends.q0[k]), size_v = 1 + std::abs(ends.v0[k]);
    total += e_q_[k] * e_q_[k] / (size_q * size_q) + (e_v_[k] * e_v_[k] + e_energy_[k]) / (size_v * size_v);
  }
  const double scaled = 0.1 * std::pow(tolerance, (n_s_ + 1.0) / (2.0 * n_s_));  // (6)
  return std::sqrt(total / (2 * n_q_)) / scaled;
}

}  // namespace ricochet
