#include "methods/modes/mode_rows.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {

ModeRows::ModeRows(const Problem& problem)
    : problem_(problem),
      info_(problem.info()),
      modes_(problem.info().contacts.size(), ContactMode::open),
      first_(modes_.size(), 0),
      is_held_(modes_.size(), 0) {
  closed_.reserve(modes_.size());
  rows_.reserve(static_cast<std::size_t>(info_.n_c() + info_.n_lambda_t));
  direction_.setZero(info_.n_lambda_t);
  packed_n_.setZero(info_.n_normal_entries);
  packed_t_.setZero(info_.n_tangent_entries);
  bias_.setZero(info_.n_c());
}

void ModeRows::set_modes(std::span<const ContactMode> modes) {
  std::ranges::copy(modes, modes_.begin());
  std::ranges::fill(is_held_, 0);
  closed_.clear();
  rows_.clear();
  has_friction_ = turns_ = slips_ = false;
  is_affine_ = true;
  for (int i = 0; i < info_.n_c(); ++i) {
    const auto& contact = info_.contacts[i];
    if (!is_closed(modes_[i])) continue;
    closed_.push_back(i);
    first_[i] = static_cast<int>(rows_.size());
    rows_.push_back({i, -1});
    if (modes_[i] == ContactMode::stick) {
      for (int d = 0; d < contact.n_t; ++d) rows_.push_back({i, d});
    }
    if (contact.n_t == 1) direction_[contact.tangent_index] = slip_sign(modes_[i]);
    has_friction_ = has_friction_ || contact.n_t > 0;
    turns_ = turns_ || (contact.n_t > 0 && !contact.is_affine);
    slips_ = slips_ || is_slipping(modes_[i]);
    is_affine_ = is_affine_ && contact.is_affine && modes_[i] != ContactMode::slip;
  }
  if (turns_ && T_.size() == 0) T_.setZero(info_.n_lambda_t, info_.n_q);
}

void ModeRows::hold_direction(int contact, const double* d) {
  is_held_[contact] = d != nullptr;
  if (!d) return;
  for (int k = 0; k < info_.contacts[contact].n_t; ++k) direction_[info_.contacts[contact].tangent_index + k] = d[k];
}

double ModeRows::dot(const Row& row, const double* x) const {
  return packed_dot(info_.contacts[row.contact], entries(row), x);
}

void ModeRows::add(const Row& row, double* x) const {
  const double* column = entries(row);
  for (const int k : info_.contacts[row.contact].pushed()) x[k] += *column++;
}

/// The friction of a slipping contact, mu J_t d.
void ModeRows::subtract_friction(int i, const double* v, double* column) {
  const auto& contact = info_.contacts[i];
  const auto pushed = contact.pushed();
  const std::size_t size = contact.support.size();
  const double* J_t = packed_t_.data() + contact.tangent_begin;
  double* d = direction_.data() + contact.tangent_index;
  if (modes_[i] == ContactMode::slip && !is_held_[i]) {
    for (int k = 0; k < 2; ++k) d[k] = dot({i, k}, v);
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

void ModeRows::set_columns(const double* q, const double* v, Matrix& C) {
  problem_.normal_jacobian_of(closed_, q, packed_n_.data());
  if (has_friction_) problem_.tangent_jacobian_of(closed_, q, packed_t_.data());
  C.setZero();
  for (Eigen::Index r = 0; r < size(); ++r) {
    const Row& row = rows_[static_cast<std::size_t>(r)];
    const auto pushed = info_.contacts[row.contact].pushed();
    double* column = C.col(r).data();
    const double* J = entries(row);
    for (std::size_t s = 0; s < pushed.size(); ++s) column[pushed[s]] = J[s];
    if (row.tangent < 0 && is_slipping(modes_[row.contact])) subtract_friction(row.contact, v, column);
  }
}

void ModeRows::set_rates(const double* q, const double* v, Vector& b) {
  problem_.gap_acceleration_bias_of(closed_, q, v, bias_.data());
  if (turns_) problem_.slip_velocity_derivative(q, v, T_.data());
  for (Eigen::Index r = 0; r < size(); ++r) {
    const auto [i, tangent] = rows_[static_cast<std::size_t>(r)];
    const auto& contact = info_.contacts[i];
    b[r] = tangent < 0 ? bias_[i] : 0;
    if (tangent < 0 || contact.is_affine) continue;
    for (const int k : contact.support) b[r] += T_(contact.tangent_index + tangent, k) * v[k];
  }
}

}  // namespace ricochet
