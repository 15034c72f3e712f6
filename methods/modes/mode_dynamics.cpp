#include "methods/modes/mode_dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// A pivot of D, as a part of its diagonal entry, that is rounding: of redundant contacts, not of different masses.
constexpr double kDependent = 1e-11;
// Refinement of the forces of redundant contacts: parts of the residual.
constexpr double kRefined = 1e-13, kStalls = 0.25, kRounding = 1e-15;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxRefinements = 8;
// Coordinates up to which P is formed.
constexpr Eigen::Index kFewCoordinates = 16;
// Step of difference quotients, relative to 1 + |x|: the square root of rounding.
constexpr double kDifference = 1.5e-8;

}  // namespace

ModeDynamics::ModeDynamics(const Problem& problem, Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      counters_(counters),
      u_(problem.info().u.data()),
      constant_mass_(problem.info().structure.constant_mass),
      rows_(problem),
      mass_(problem.n_q(), problem.info().structure.diagonal_mass) {
  const int n_q = info_.n_q, most = info_.n_c() + info_.n_lambda_t;
  M_.setZero(n_q, n_q);
  for (auto* x : {&f_, &row_, &q_, &v_, &zero_}) x->setZero(n_q);
  for (auto* x : {&lambda_, &rates_, &diagonal_, &law_, &kept_law_}) x->setZero(most);
  gap_.setZero(info_.n_c());
  C_.setZero(n_q, 0);
  MC_ = C_;
  if (constant_mass_) factorize_mass(info_.q0.data());
}

bool ModeDynamics::factorize_mass(const double* q) {
  problem_.mass_matrix(q, M_.data());
  ++counters_.mass_factorizations;
  return mass_.compute(M_);
}

void ModeDynamics::set_modes(std::span<const ContactMode> modes, const double* q, const double* v) {
  ++mode_changes_;
  rows_.set_modes(modes);
  law_.setZero();
  is_redundant_ = has_inverse_ = false;
  if (const Eigen::Index n = rows_.size(); C_.cols() != n) {
    C_.resize(info_.n_q, n);
    MC_.resize(info_.n_q, n);
    D_.resize(n, n);
    scaled_.A.resize(n, n);
    for (auto* x : {&scaled_.scale, &scaled_.b, &scaled_.law, &scaled_.x, &scaled_.residual, &scaled_.step})
      x->resize(n);
  }
  kind_ = Kind::general;
  if (constant_mass_ && rows_.is_affine()) set_maps(q, v);
}

/// (4)
void ModeDynamics::set_maps(const double* q, const double* v) {
  const Eigen::Index n = MC_.cols(), n_q = info_.n_q;
  set_columns(q, v);
  L_.setZero(n, n_q);  // R' M^-1, and then what solves D L = -R' M^-1
  for (Eigen::Index r = 0; r < n; ++r) {
    row_.setZero();
    rows_.add(rows_[r], row_.data());
    mass_.solve(row_.data());
    L_.row(r) = -row_.transpose();
    set_delassus_row(r);
  }
  if (!eliminate(L_)) return;  // redundant: they are resolved at every point
  if (n_q <= kFewCoordinates) {
    P_.setZero(n_q, n_q);
    for (Eigen::Index k = 0; k < n_q; ++k) {
      row_.setZero();
      row_[k] = 1;
      mass_.solve(row_.data());
      P_.col(k) = row_;
    }
    if (n > 0) P_.noalias() += MC_ * L_;
    kind_ = Kind::map;
  } else {
    kind_ = Kind::factors;
  }
}

void ModeDynamics::set_forces(const Vector& lambda_n, const Vector& lambda_t) {
  for (Eigen::Index r = 0; r < rows_.size(); ++r) {
    const auto [i, tangent] = rows_[r];
    law_[r] = tangent < 0 ? lambda_n[i] : lambda_t[info_.contacts[i].tangent_index + tangent];
  }
}

/// C and M^-1 C, with the directions of slip at v.
void ModeDynamics::set_columns(const double* q, const double* v) {
  rows_.set_columns(q, v, C_);
  MC_ = C_;
  for (Eigen::Index r = 0; r < MC_.cols(); ++r) mass_.solve(MC_.col(r).data());
}

/// A row of D.
void ModeDynamics::set_delassus_row(Eigen::Index r) {
  for (Eigen::Index c = 0; c < D_.cols(); ++c) D_(r, c) = rows_.dot(rows_[r], MC_.col(c).data());
}

/// X <- D^-1 X, D is lost. Without pivots, since D is that of a mechanical system: nearly symmetric, positive on the
/// diagonal. @return false when D is singular: redundant contacts
template <class Columns>
bool ModeDynamics::eliminate(Columns& X) {
  const Eigen::Index n = D_.cols();
  for (Eigen::Index k = 0; k < n; ++k) diagonal_[k] = D_(k, k);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!(D_(k, k) > kDependent * diagonal_[k]) && !(n == 1 && D_(k, k) != 0)) return false;
    for (Eigen::Index r = k + 1; r < n; ++r) {
      const double factor = D_(r, k) / D_(k, k);
      if (factor == 0) continue;
      for (Eigen::Index c = k + 1; c < n; ++c) D_(r, c) -= factor * D_(k, c);
      for (Eigen::Index c = 0; c < X.cols(); ++c) X(r, c) -= factor * X(k, c);
    }
  }
  for (Eigen::Index k = n - 1; k >= 0; --k) {
    const double inverse = 1 / D_(k, k);
    for (Eigen::Index c = 0; c < X.cols(); ++c) {
      for (Eigen::Index r = k + 1; r < n; ++r) X(k, c) -= D_(k, r) * X(r, c);
      X(k, c) *= inverse;
    }
  }
  return true;
}

/// (3) for a = M^-1 f, as nearly as redundant rows allow. @return whether (2) holds
bool ModeDynamics::solve_rows(const double* a, Consistency consistency) {
  const Eigen::Index n = D_.cols();
  const auto set = [&] {
    for (Eigen::Index r = 0; r < n; ++r) {
      lambda_[r] = -rows_.dot(rows_[r], a) - rates_[r];
      set_delassus_row(r);
    }
  };
  set();
  if (!is_redundant_) {
    if (eliminate(lambda_)) return true;
    is_redundant_ = true;
    set();
  }
  // Scaled, so that units do not matter.
  Scaled& s = scaled_;
  s.scale = D_.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  s.A.noalias() = s.scale.asDiagonal() * D_ * s.scale.asDiagonal();
  s.b = s.scale.cwiseProduct(lambda_.head(n));
  const double size = (s.b.cwiseAbs() + s.scale.cwiseProduct(rates_.head(n).cwiseAbs())).maxCoeff();
  const double allowed = consistency == Consistency::required ? consistent_ * size : kInfinity;
  s.law = law_.head(n).cwiseQuotient(s.scale);
  s.x = s.law;
  bool is_solved = rows_.is_symmetric() && approach_redundant() <= allowed;
  if (!is_solved) {
    s.x = s.law + least_squares(s.A, s.b - s.A * s.law);
    is_solved = (s.b - s.A * s.x).cwiseAbs().maxCoeff() <= allowed;
  }
  lambda_.head(n) = s.scale.cwiseProduct(s.x);
  return is_solved;
}

/// From x to the nearest solution of A x = b, by refinement until it no longer makes the residual smaller. The pseudo-inverse
/// of an earlier point is used as long as that ends where the one of that point did. @return the residual
double ModeDynamics::approach_redundant() {
  Scaled& s = scaled_;
  const auto set_residual = [&] {
    s.residual = s.b;
    s.residual.noalias() -= s.A * s.x;
  };
  set_residual();
  const double first = s.residual.cwiseAbs().maxCoeff();
  const auto refine = [&] {
    double left = first;
    for (int k = 0; k < kMaxRefinements && left > kRounding * first; ++k) {
      s.step = s.residual;
      redundant_.apply_in_place(s.step);
      s.residual.noalias() -= s.A * s.step;
      const double next = s.residual.cwiseAbs().maxCoeff();
      if (!(next < left)) break;
      s.x += s.step;
      const double last = std::exchange(left, next);
      if (left > kStalls * last) break;
    }
    return left;
  };
  if (has_inverse_) {
    const double left = refine();
    if (left <= std::max(2 * left_by_inverse_, kRefined) * first) return left;
    s.x = s.law;
    set_residual();
  }
  redundant_.factorize(s.A);
  has_inverse_ = true;
  const double left = refine();
  left_by_inverse_ = first > 0 ? left / first : 0;
  return left;
}

/// a from f_.
bool ModeDynamics::accelerate_in_general(const double* q, const double* v, double* a) {
  if (!constant_mass_ && !factorize_mass(q)) return false;
  std::copy(f_.data(), f_.data() + f_.size(), a);
  mass_.solve(a);
  if (rows_.empty()) return true;
  set_columns(q, v);
  rows_.set_rates(q, v, rates_);
  if (!solve_rows(a)) return false;
  for (Eigen::Index r = 0; r < MC_.cols(); ++r) {
    const double force = lambda_[r];
    const double* column = MC_.col(r).data();
    for (Eigen::Index k = 0; k < MC_.rows(); ++k) a[k] += column[k] * force;
  }
  return true;
}

/// (4) for many coordinates.
bool ModeDynamics::accelerate_by_factors(double* a) {
  std::copy(f_.data(), f_.data() + f_.size(), a);
  mass_.solve(a);
  if (rows_.empty()) return true;
  lambda_.head(L_.rows()).noalias() = L_ * f_;
  Eigen::Map<Vector>(a, info_.n_q).noalias() += MC_ * lambda_.head(L_.rows());
  return true;
}

bool ModeDynamics::acceleration_jacobians(const Vector& q, const Vector& v, const Vector& a, Matrix& a_q, Matrix& a_v) {
  if (kind_ != Kind::general) {
    ++counters_.jacobian_evaluations;
    problem_.force_jacobians(q.data(), v.data(), u_, a_q.data(), a_v.data());
    for (Matrix* jacobian : {&a_q, &a_v}) {
      for (Eigen::Index k = 0; k < info_.n_q; ++k) {
        f_ = jacobian->col(k);
        accelerate_by_factors(jacobian->col(k).data());
      }
    }
    return true;
  }
  q_ = q;
  v_ = v;
  const auto differentiate = [&](Vector& x, Matrix& jacobian) {
    for (Eigen::Index k = 0; k < info_.n_q; ++k) {
      const double at = x[k];
      x[k] += kDifference * (1 + std::abs(at));
      const double step = x[k] - at;
      if (!accelerate(q_.data(), v_.data(), jacobian.col(k).data())) return false;
      jacobian.col(k) = (jacobian.col(k) - a) / step;
      x[k] = at;
    }
    return true;
  };
  return differentiate(q_, a_q) && differentiate(v_, a_v);
}

void ModeDynamics::tangential_force(int contact, double* force) const {
  const auto& info = info_.contacts[contact];
  const bool sticks = modes()[contact] == ContactMode::stick;
  for (int d = 0; d < info.n_t; ++d) {
    force[d] = sticks ? lambda_[rows_.first(contact) + 1 + d]
                      : -info.mu * lambda_[rows_.first(contact)] * rows_.direction(contact)[d];
  }
}

double ModeDynamics::cone_margin(int contact) const {
  double force[2]{0, 0};
  tangential_force(contact, force);
  const double size = info_.contacts[contact].n_t == 1 ? std::abs(force[0]) : std::hypot(force[0], force[1]);
  return info_.contacts[contact].mu * normal_force(contact) - size;
}

/// C and what solves with M, at a point.
bool ModeDynamics::set_point(const double* q, const double* v) {
  if (!constant_mass_ && !factorize_mass(q)) return false;
  set_columns(q, v);
  return true;
}

/// x <- x - M^-1 C D^-1 rates
void ModeDynamics::remove_rates(double* x) {
  solve_rows(zero_.data(), Consistency::as_near_as_possible);  // what rounding has left contradicts itself
  for (Eigen::Index r = 0; r < MC_.cols(); ++r) {
    for (Eigen::Index k = 0; k < MC_.rows(); ++k) x[k] += MC_(k, r) * lambda_[r];
  }
}

void ModeDynamics::correct_velocities(double* v) {
  for (Eigen::Index r = 0; r < rows_.size(); ++r) rates_[r] = rows_.dot(rows_[r], v);
  remove_rates(v);
}

/// With columns of R in place of those of C. @param gap  of the closed contacts
void ModeDynamics::correct_positions(const Vector& gap, double* q) {
  for (Eigen::Index r = 0; r < rows_.size(); ++r) {
    const ModeRows::Row& row = rows_[r];
    if (row.tangent >= 0 || !is_slipping(modes()[row.contact])) continue;
    MC_.col(r).setZero();
    rows_.add(row, MC_.col(r).data());
    mass_.solve(MC_.col(r).data());
  }
  for (Eigen::Index r = 0; r < rows_.size(); ++r) rates_[r] = rows_[r].tangent < 0 ? gap[rows_[r].contact] : 0;
  remove_rates(q);
}

bool ModeDynamics::project(double* q, double* v, Order order) {
  if (rows_.empty()) return true;
  kept_law_.swap(law_);
  law_.setZero();
  problem_.gap_of(rows_.closed(), q, gap_.data());
  bool is_done = set_point(q, v);
  if (is_done && order == Order::velocity_first) {
    correct_velocities(v);
    correct_positions(gap_, q);
  } else if (is_done) {
    correct_positions(gap_, q);
    is_done = set_point(q, v);
    if (is_done) correct_velocities(v);
  }
  law_.swap(kept_law_);
  if (kind_ == Kind::factors) set_columns(q, v);  // (4) is evaluated with those of C
  return is_done && std::isfinite(std::accumulate(v, v + info_.n_q, std::accumulate(q, q + info_.n_q, 0.0)));
}

}  // namespace ricochet
