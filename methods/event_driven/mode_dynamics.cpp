#include "methods/event_driven/mode_dynamics.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

// A pivot of D, as a part of its diagonal entry, that is rounding: of redundant contacts, not of different masses.
constexpr double kDependent = 1e-11;
// What redundant rows may leave of (2), as a part of its terms.
constexpr double kConsistent = 1e-9;

}  // namespace

ModeDynamics::ModeDynamics(const Problem& problem, Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      counters_(counters),
      u_(problem.info().u.data()),
      constant_mass_(problem.info().structure.constant_mass),
      diagonal_mass_(problem.info().structure.diagonal_mass),
      modes_(problem.info().contacts.size(), ContactMode::open),
      row_(modes_.size(), 0),
      chosen_(modes_.size(), 0),
      is_held_(modes_.size(), 0) {
  const int n_q = info_.n_q, most = info_.n_c() + info_.n_lambda_t;
  closed_.reserve(modes_.size());
  rows_.reserve(static_cast<std::size_t>(most));
  direction_.setZero(info_.n_lambda_t);
  M_.setZero(n_q, n_q);
  f_.setZero(n_q);
  inverse_mass_.setZero(n_q);
  lambda_.setZero(most);
  rates_.setZero(most);
  diagonal_.setZero(most);
  packed_n_.setZero(info_.n_normal_entries);
  packed_t_.setZero(info_.n_tangent_entries);
  bias_.setZero(info_.n_c());
  if (constant_mass_) factorize_mass(info_.q0.data());
}

/// M or, where it is constant, its factor: L of L L' in the lower triangle.
bool ModeDynamics::factorize_mass(const double* q) {
  const Eigen::Index n = info_.n_q;
  problem_.mass_matrix(q, M_.data());
  ++counters_.mass_factorizations;
  if (diagonal_mass_) {
    inverse_mass_ = M_.diagonal().cwiseInverse();
    return M_.diagonal().minCoeff() > 0;
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    double pivot = M_(j, j);
    for (Eigen::Index k = 0; k < j; ++k) pivot -= M_(j, k) * M_(j, k);
    if (!(pivot > 0)) return false;
    M_(j, j) = std::sqrt(pivot);
    inverse_mass_[j] = 1 / M_(j, j);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      double entry = M_(i, j);
      for (Eigen::Index k = 0; k < j; ++k) entry -= M_(i, k) * M_(j, k);
      M_(i, j) = entry * inverse_mass_[j];
    }
  }
  return true;
}

/// x <- M^-1 x
void ModeDynamics::solve_mass(double* x) const {
  const Eigen::Index n = info_.n_q;
  if (diagonal_mass_) {
    for (Eigen::Index i = 0; i < n; ++i) x[i] *= inverse_mass_[i];
    return;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index k = 0; k < i; ++k) x[i] -= M_(i, k) * x[k];
    x[i] *= inverse_mass_[i];
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    for (Eigen::Index k = i + 1; k < n; ++k) x[i] -= M_(k, i) * x[k];
    x[i] *= inverse_mass_[i];
  }
}

bool ModeDynamics::set_modes(std::span<const ContactMode> modes, const double* q, const double* v) {
  std::ranges::copy(modes, modes_.begin());
  std::ranges::fill(is_held_, 0);
  closed_.clear();
  rows_.clear();
  has_friction_ = turns_ = false;
  bool is_affine = constant_mass_;
  for (int i = 0; i < info_.n_c(); ++i) {
    const auto& contact = info_.contacts[i];
    chosen_[i] = is_closed(modes_[i]);
    if (!chosen_[i]) continue;
    closed_.push_back(i);
    row_[i] = static_cast<int>(rows_.size());
    rows_.push_back({i, -1});
    if (modes_[i] == ContactMode::stick) {
      for (int d = 0; d < contact.n_t; ++d) rows_.push_back({i, d});
    }
    if (contact.n_t == 1) direction_[contact.tangent_index] = slip_sign(modes_[i]);
    has_friction_ = has_friction_ || contact.n_t > 0;
    turns_ = turns_ || (contact.n_t > 0 && !contact.is_affine);
    is_affine = is_affine && contact.is_affine && modes_[i] != ContactMode::slip;
  }
  const auto n = static_cast<Eigen::Index>(rows_.size());
  if (C_.cols() != n) {
    C_.resize(info_.n_q, n);
    MC_.resize(info_.n_q, n);
    D_.resize(n, n);
  }
  if (turns_ && T_.size() == 0) T_.setZero(info_.n_lambda_t, info_.n_q);
  kind_ = Kind::general;
  if (!is_affine) return accelerate(q, v, Vector(info_.n_q).data());

  // (4), column by column: f is a unit vector, and b = 0.
  P_.resize(info_.n_q, info_.n_q);
  L_.resize(n, info_.n_q);
  bool is_done = true;
  for (int k = 0; k < info_.n_q; ++k) {
    f_.setZero();
    f_[k] = 1;
    is_done = accelerate_in_general(q, v, P_.col(k).data()) && is_done;
    L_.col(k) = lambda_.head(n);
  }
  kind_ = Kind::affine;
  return is_done;
}

void ModeDynamics::hold_direction(int contact, const double* d) {
  is_held_[contact] = d != nullptr;
  if (!d) return;
  for (int k = 0; k < info_.contacts[contact].n_t; ++k) direction_[info_.contacts[contact].tangent_index + k] = d[k];
}

double ModeDynamics::row_dot(const Row& row, const double* x) const {
  const auto& contact = info_.contacts[row.contact];
  const double* column = row.tangent < 0 ? packed_n_.data() + contact.normal_begin
                                         : packed_t_.data() + contact.tangent_begin +
                                               row.tangent * static_cast<int>(contact.support.size());
  return packed_dot(contact, column, x);
}

/// C and M^-1 C, with the directions of slip at v.
void ModeDynamics::set_columns(const double* q, const double* v) {
  problem_.normal_jacobian_of(chosen_.data(), q, packed_n_.data());
  if (has_friction_) problem_.tangent_jacobian_of(chosen_.data(), q, packed_t_.data());
  C_.setZero();
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const auto [i, tangent] = rows_[r];
    const auto& contact = info_.contacts[i];
    const auto pushed = contact.pushed();
    const std::size_t size = contact.support.size();
    double* column = C_.col(static_cast<Eigen::Index>(r)).data();
    const double* J_n = packed_n_.data() + contact.normal_begin;
    const double* J_t = packed_t_.data() + contact.tangent_begin;
    if (tangent >= 0) {
      for (std::size_t s = 0; s < pushed.size(); ++s)
        column[pushed[s]] = J_t[static_cast<std::size_t>(tangent) * size + s];
      continue;
    }
    for (std::size_t s = 0; s < pushed.size(); ++s) column[pushed[s]] = J_n[s];
    if (!is_slipping(modes_[i])) continue;
    double* d = direction_.data() + contact.tangent_index;
    if (modes_[i] == ContactMode::slip && !is_held_[i]) {
      for (int k = 0; k < 2; ++k) d[k] = row_dot({i, k}, v);
      const double speed = std::hypot(d[0], d[1]);
      if (speed > 0) {
        d[0] /= speed;
        d[1] /= speed;
      }
    }
    for (int k = 0; k < contact.n_t; ++k) {
      for (std::size_t s = 0; s < pushed.size(); ++s)
        column[pushed[s]] -= contact.mu * d[k] * J_t[static_cast<std::size_t>(k) * size + s];
    }
  }
  MC_ = C_;
  for (Eigen::Index r = 0; r < MC_.cols(); ++r) solve_mass(MC_.col(r).data());
}

/// b of (2), in rates_.
void ModeDynamics::set_rates(const double* q, const double* v) {
  problem_.gap_acceleration_bias(q, v, bias_.data());
  if (turns_) problem_.slip_velocity_derivative(q, v, T_.data());
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const auto [i, tangent] = rows_[r];
    const auto& contact = info_.contacts[i];
    double b = tangent < 0 ? bias_[i] : 0;
    if (tangent >= 0 && !contact.is_affine) {
      for (const int k : contact.support) b += T_(contact.tangent_index + tangent, k) * v[k];
    }
    rates_[static_cast<Eigen::Index>(r)] = b;
  }
}

/// (3) for a = M^-1 f; false when (2) contradicts itself.
bool ModeDynamics::solve_rows(const double* a) {
  const auto n = static_cast<Eigen::Index>(rows_.size());
  for (Eigen::Index r = 0; r < n; ++r) {
    lambda_[r] = -row_dot(rows_[r], a) - rates_[r];
    for (Eigen::Index c = 0; c < n; ++c) D_(r, c) = row_dot(rows_[r], MC_.col(c).data());
  }
  if (n == 1) {
    if (!(D_(0, 0) != 0)) return false;
    lambda_[0] /= D_(0, 0);
    return true;
  }
  // Elimination without pivots, since D is that of a mechanical system: nearly symmetric, positive on the diagonal.
  double* x = lambda_.data();
  bool is_regular = true;
  for (Eigen::Index k = 0; k < n; ++k) diagonal_[k] = D_(k, k);
  for (Eigen::Index k = 0; k < n && is_regular; ++k) {
    is_regular = D_(k, k) > kDependent * diagonal_[k];
    for (Eigen::Index r = k + 1; r < n && is_regular; ++r) {
      const double factor = D_(r, k) / D_(k, k);
      if (factor == 0) continue;
      for (Eigen::Index c = k + 1; c < n; ++c) D_(r, c) -= factor * D_(k, c);
      x[r] -= factor * x[k];
    }
  }
  if (is_regular) {
    for (Eigen::Index k = n - 1; k >= 0; --k) {
      for (Eigen::Index c = k + 1; c < n; ++c) x[k] -= D_(k, c) * x[c];
      x[k] /= D_(k, k);
    }
    return true;
  }
  Vector scale(n), b(n), size(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    b[r] = -row_dot(rows_[r], a) - rates_[r];
    size[r] = std::abs(b[r]) + std::abs(rates_[r]);
    for (Eigen::Index c = 0; c < n; ++c) D_(r, c) = row_dot(rows_[r], MC_.col(c).data());
    scale[r] = 1 / std::sqrt(std::abs(D_(r, r)));
  }
  const Matrix scaled = scale.asDiagonal() * D_ * scale.asDiagonal();
  const Vector y = least_squares(scaled, scale.cwiseProduct(b));
  lambda_.head(n) = scale.cwiseProduct(y);
  const Vector left = scaled * y - scale.cwiseProduct(b);
  return left.cwiseAbs().maxCoeff() <= kConsistent * (1e-300 + scale.cwiseProduct(size).maxCoeff());
}

/// a from f_.
bool ModeDynamics::accelerate_in_general(const double* q, const double* v, double* a) {
  if (!constant_mass_ && !factorize_mass(q)) return false;
  std::copy(f_.data(), f_.data() + f_.size(), a);
  solve_mass(a);
  if (rows_.empty()) return true;
  set_columns(q, v);
  set_rates(q, v);
  if (!solve_rows(a)) return false;
  for (Eigen::Index r = 0; r < MC_.cols(); ++r) {
    const double force = lambda_[r];
    const double* column = MC_.col(r).data();
    for (Eigen::Index k = 0; k < MC_.rows(); ++k) a[k] += column[k] * force;
  }
  return true;
}

void ModeDynamics::tangential_force(int contact, double* force) const {
  const auto& info = info_.contacts[contact];
  const bool sticks = modes_[contact] == ContactMode::stick;
  for (int d = 0; d < info.n_t; ++d) {
    force[d] = sticks ? lambda_[row_[contact] + 1 + d]
                      : -info.mu * lambda_[row_[contact]] * direction_[info.tangent_index + d];
  }
}

double ModeDynamics::cone_margin(int contact) const {
  double force[2]{0, 0};
  tangential_force(contact, force);
  const double size = info_.contacts[contact].n_t == 1 ? std::abs(force[0]) : std::hypot(force[0], force[1]);
  return info_.contacts[contact].mu * normal_force(contact) - size;
}

bool ModeDynamics::project(double* q, double* v) {
  const auto n = static_cast<Eigen::Index>(rows_.size());
  if (n == 0) return true;
  if (!constant_mass_ && !factorize_mass(q)) return false;
  Vector gap(info_.n_c());
  problem_.gap(q, gap.data());
  // Columns of R in place of those of C.
  set_columns(q, v);
  for (Eigen::Index r = 0; r < n; ++r) {
    const auto [i, tangent] = rows_[r];
    if (tangent >= 0 || !is_slipping(modes_[i])) continue;
    const auto pushed = info_.contacts[i].pushed();
    MC_.col(r).setZero();
    for (std::size_t s = 0; s < pushed.size(); ++s) MC_(pushed[s], r) = packed_n_[info_.contacts[i].normal_begin + s];
    solve_mass(MC_.col(r).data());
  }
  const Vector zero = Vector::Zero(info_.n_q);
  std::vector<Row> all = rows_;
  const auto correct = [&](double* x) {
    if (!solve_rows(zero.data())) return false;
    for (Eigen::Index r = 0; r < MC_.cols(); ++r) {
      for (Eigen::Index k = 0; k < MC_.rows(); ++k) x[k] += MC_(k, r) * lambda_[r];
    }
    return true;
  };
  for (Eigen::Index r = 0; r < n; ++r) rates_[r] = rows_[r].tangent < 0 ? gap[rows_[r].contact] : 0;
  if (!correct(q)) return false;
  for (Eigen::Index r = 0; r < n; ++r) rates_[r] = row_dot(rows_[r], v);
  return correct(v);
}

}  // namespace ricochet
