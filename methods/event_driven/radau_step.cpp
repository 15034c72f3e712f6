#include "methods/event_driven/radau_step.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 10;
constexpr double kKeptContraction = 1e-3;  // up to which the Jacobian is kept
constexpr double kNewton = 0.01;           // of the tolerance
constexpr double kRounding = 1e-15;        // relative: corrections cannot become smaller
constexpr double kKeptGrowth = 1.2;        // of RADAU

}  // namespace

RadauStep::RadauStep(const ButcherTableau& tableau, int n_q, ModeDynamics& dynamics)
    : dynamics_(dynamics),
      c_(tableau.c),
      A_transposed_(tableau.A.transpose()),
      A_inverse_transposed_(solve_partial_pivoting(tableau.A, Matrix::Identity(tableau.n_s, tableau.n_s)).transpose()),
      system_(tableau, n_q),
      error_(tableau, system_.real_eigenvalue(), n_q),
      last_(tableau.c, n_q),
      polynomial_(tableau.c, n_q) {
  ends.resize(n_q);
  order = tableau.order;
  error_order = tableau.n_s;
  kept_growth = kKeptGrowth;
  for (auto* x : {&w_, &q_, &a_, &residual_, &correction_, &moved_}) x->setZero(n_q, tableau.n_s);
  stage_v_.setZero(n_q);
  J_.q.setZero(n_q, n_q);
  J_.v.setZero(n_q, n_q);
}

void RadauStep::start(double tolerance) {
  tolerance_ = tolerance;
  J_.is_known = J_.is_fresh = false;
  contraction_ = left_ = 1;
  last_.forget();
}

bool RadauStep::take(double h, EventFunctions* watched) {
  ends.h = h;
  ends.collocation = &polynomial_;
  if (J_.mode_changes != dynamics_.mode_changes()) {
    J_.is_known = J_.is_fresh = false;
    last_.forget();
  }
  const bool is_kept = J_.is_known && (J_.is_fresh || contraction_ <= kKeptContraction);
  if (!is_kept && !linearize()) return false;
  if (h != system_.h() && !factorize()) return false;
  last_.predict(ends, w_);
  if (!iterate()) {
    if (J_.is_fresh || !linearize() || !factorize()) return false;
    last_.predict(ends, w_);
    if (!iterate()) return false;
  }
  ends.q1 = q_.rightCols<1>();
  ends.v1 = ends.v0 + w_.rightCols<1>();
  polynomial_.set(ends.h, w_);
  error_.estimate(ends, q_, w_, J_.q, system_);
  for (Eigen::Index i = 0; watched && i + 1 < w_.cols(); ++i) {
    stage_v_ = ends.v0 + w_.col(i);
    if (!dynamics_.accelerate(q_.col(i).data(), stage_v_.data(), a_.col(i).data())) return false;
    watched->record_stage(c_[i]);
  }
  return true;
}

bool RadauStep::finish() {
  if (!dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data())) return false;
  last_.keep(ends, polynomial_);
  J_.is_fresh = false;
  return true;
}

bool RadauStep::linearize() {
  if (!dynamics_.acceleration_jacobians(ends.q0, ends.v0, ends.a0, J_.q, J_.v)) return false;
  J_.mode_changes = dynamics_.mode_changes();
  J_.is_known = J_.is_fresh = true;
  contraction_ = left_ = 1;
  system_.forget();
  return true;
}

bool RadauStep::factorize() {
  if (!system_.factorize(ends.h, J_.q, J_.v)) return false;
  dynamics_.counters().matrix_factorizations += system_.n_factors();
  return true;
}

/// a of all stages.
bool RadauStep::set_accelerations() {
  for (Eigen::Index i = 0; i < w_.cols(); ++i) {
    stage_v_ = ends.v0 + w_.col(i);
    if (!dynamics_.accelerate(q_.col(i).data(), stage_v_.data(), a_.col(i).data())) return false;
  }
  return a_.allFinite();
}

bool RadauStep::iterate() {
  q_.noalias() = w_.lazyProduct(A_transposed_);  // (1)
  for (Eigen::Index i = 0; i < q_.cols(); ++i) q_.col(i) = ends.q0 + ends.h * (c_[i] * ends.v0 + q_.col(i));
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

/// A correction of Newton's method. @return the root mean square of the correction of (q, v), of 1 + |x|
double RadauStep::correct() {
  residual_.noalias() = w_.lazyProduct(A_inverse_transposed_);
  residual_ = a_ - residual_ / ends.h;
  system_.solve(residual_, correction_);
  dynamics_.counters().linear_solves += system_.n_factors();
  w_ += correction_;
  moved_.noalias() = ends.h * correction_.lazyProduct(A_transposed_);
  q_ += moved_;
  double total = 0;
  for (Eigen::Index i = 0; i < w_.cols(); ++i) {
    for (Eigen::Index k = 0; k < w_.rows(); ++k) {
      const double q = moved_(k, i) / (1 + std::abs(ends.q0[k])), v = correction_(k, i) / (1 + std::abs(ends.v0[k]));
      total += q * q + v * v;
    }
  }
  return std::sqrt(total / (2 * static_cast<double>(w_.size())));
}

}  // namespace ricochet
