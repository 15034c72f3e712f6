#include "problems/force_bounds.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr double kInverseRounding = 1e-12;  // of Y K - I and of x_0, where K is constant
constexpr int kTestIterations = 8;

}  // namespace

ForceBounds::ForceBounds(const Problem& problem)
    : problem_(problem),
      info_(problem.info()),
      modes_(problem.info().contacts.size(), ContactMode::open),
      is_held_(modes_.size(), 0),
      held_(static_cast<std::size_t>(problem.info().n_lambda_t), 0),
      row_(modes_.size(), -1) {
  if (!exist_for(problem)) return;
  const auto n = static_cast<std::size_t>(problem.n_q());
  closed_.reserve(modes_.size());
  q_point_.resize(n);
  v_point_.resize(n);
  M_.resize(n * n);
  normal_.resize(static_cast<std::size_t>(info_.n_normal_entries));
  tangent_.resize(static_cast<std::size_t>(info_.n_tangent_entries));
  bias_.resize(modes_.size());
  T_.resize(static_cast<std::size_t>(info_.n_lambda_t) * n);
}

void ForceBounds::set_modes(std::span<const ContactMode> modes) {
  std::ranges::fill(is_held_, 0);
  if (has_modes_ && std::ranges::equal(modes, modes_)) return;
  has_modes_ = true;
  is_tried_ = has_inverse_ = false;
  std::ranges::copy(modes, modes_.begin());
  closed_.clear();
  size_ = info_.n_q;
  is_constant_ = info_.structure.constant_mass;
  is_on_polygon_ = false;
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactMode mode = modes_[i];
    if (!is_closed(mode)) continue;
    closed_.push_back(i);
    row_[i] = static_cast<int>(size_);
    size_ += 1 + (mode == ContactMode::stick ? info_.contacts[i].n_t : 0);
    is_constant_ = is_constant_ && info_.contacts[i].is_affine && mode != ContactMode::slip;
    is_on_polygon_ = is_on_polygon_ || mode == ContactMode::vertex_slip || mode == ContactMode::edge_slip;
  }
}

void ForceBounds::hold_direction(int contact, const double* d) {
  is_held_[contact] = true;
  std::copy(d, d + info_.contacts[contact].n_t, held_.begin() + info_.contacts[contact].tangent_index);
}

/// Slip direction of a contact, for the tangents of set_matrix().
void ForceBounds::set_direction(int i, const Interval* v, Interval* direction) const {
  const auto& contact = info_.contacts[i];
  direction[0] = slip_sign(modes_[i]);
  if (modes_[i] != ContactMode::slip) return;
  const auto n_support = static_cast<Eigen::Index>(contact.support.size());
  Interval v_t[2] = {0.0, 0.0}, square_sum = 0.0;
  for (int k = 0; k < 2; ++k) {
    for (Eigen::Index s = 0; s < n_support; ++s)
      v_t[k] += tangent_[contact.tangent_begin + k * n_support + s] * v[contact.support[s]];
    square_sum += square(v_t[k]);
  }
  for (int k = 0; k < 2; ++k) {
    direction[k] = square_sum.lower > 0 ? intersection(v_t[k] / sqrt(square_sum), {-1, 1}) : Interval(-1, 1);
    if (is_held_[i]) direction[k] = held_[contact.tangent_index + k];
  }
}

/// Sets K over boxes, which may be points.
void ForceBounds::set_matrix(const Interval* q, const Interval* v) {
  const Eigen::Index n = info_.n_q;
  K_.assign(static_cast<std::size_t>(size_ * size_), 0.0);
  const auto K = [&](Eigen::Index row, Eigen::Index column) -> Interval& { return K_[row + column * size_]; };
  problem_.mass_bounds(q, M_.data());
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l) K(l, k) = M_[l + k * n];
  }
  problem_.normal_bounds(closed_, q, normal_.data());
  if (info_.has_friction()) problem_.tangent_bounds(closed_, q, tangent_.data());
  for (const int i : closed_) {
    const auto& contact = info_.contacts[i];
    const Eigen::Index row = row_[i];
    const auto n_support = static_cast<Eigen::Index>(contact.support.size());
    const auto n_pushed = static_cast<Eigen::Index>(contact.pushed().size());
    for (Eigen::Index s = 0; s < n_support; ++s) {
      const Interval& J = normal_[contact.normal_begin + s];
      K(row, contact.support[s]) = J;
      if (s < n_pushed) K(contact.support[s], row) = -J;
    }
    if (contact.n_t == 0) continue;
    Interval direction[2] = {0.0, 0.0};
    if (is_slipping(modes_[i])) set_direction(i, v, direction);
    for (int k = 0; k < contact.n_t; ++k) {
      for (Eigen::Index s = 0; s < n_support; ++s) {
        const Interval& J = tangent_[contact.tangent_begin + k * n_support + s];
        if (modes_[i] == ContactMode::stick) {
          K(row + 1 + k, contact.support[s]) = J;
          if (s < n_pushed) K(contact.support[s], row + 1 + k) = -J;
        } else if (s < n_pushed) {
          K(contact.support[s], row) += Interval(contact.mu) * direction[k] * J;
        }
      }
    }
  }
}

/// Y
bool ForceBounds::invert(const double* q, const double* v) {
  std::copy(q, q + info_.n_q, q_point_.begin());
  std::copy(v, v + info_.n_q, v_point_.begin());
  set_matrix(q_point_.data(), v_point_.data());
  middle_.resize(size_, size_);
  for (Eigen::Index k = 0; k < size_ * size_; ++k) middle_.data()[k] = K_[k].middle();
  factors_.compute(middle_);
  if (!(factors_.rcond() > 1e-14)) return false;  // redundant contacts
  Y_ = factors_.inverse();
  return Y_.allFinite();
}

/// Sets b over boxes.
void ForceBounds::set_right_side(const Interval* q, const Interval* v) {
  b_.assign(static_cast<std::size_t>(size_), 0.0);
  problem_.force_bounds(q, v, info_.u.data(), b_.data());
  const auto is_curved = [&](int i) { return !info_.contacts[i].is_affine || info_.contacts[i].is_moving; };
  if (std::ranges::none_of(closed_, is_curved)) return;
  problem_.gap_bias_bounds(closed_, q, v, bias_.data());
  if (info_.has_friction()) problem_.slip_derivative_bounds(closed_, q, v, T_.data());
  for (const int i : closed_) {
    if (!is_curved(i)) continue;
    const auto& contact = info_.contacts[i];
    b_[row_[i]] = -bias_[i];
    if (modes_[i] != ContactMode::stick) continue;
    for (int k = 0; k < contact.n_t; ++k) {
      Interval sum = 0.0;
      for (const int l : contact.support) sum += T_[contact.tangent_index + k + l * info_.n_lambda_t] * v[l];
      b_[row_[i] + 1 + k] = -sum;
    }
  }
}

bool ForceBounds::evaluate(const Interval* q, const Interval* v, const double* q_middle, const double* v_middle) {
  const Eigen::Index n = info_.n_q;
  if (!exist_for(problem_) || is_on_polygon_) return false;
  if (!is_constant_ || !is_tried_) {
    has_inverse_ = invert(q_middle, v_middle);
    is_tried_ = true;
  }
  if (!has_inverse_) return false;
  if (!is_constant_) set_matrix(q, v);
  set_right_side(q, v);
  const Eigen::Index first = is_constant_ ? n : 0;  // forces are all that counts, unless (2) needs the rest
  x_.assign(static_cast<std::size_t>(size_), 0.0);
  for (Eigen::Index l = first; l < size_; ++l) {
    for (Eigen::Index k = 0; k < size_; ++k) {
      if (Y_(l, k) != 0) x_[l] += Interval(Y_(l, k)) * b_[k];
    }
  }
  if (!is_constant_) return contract();
  for (Eigen::Index l = first; l < size_; ++l) {
    const double rounding = kInverseRounding * x_[l].magnitude();
    x_[l] = {x_[l].lower - rounding, x_[l].upper + rounding};
  }
  return true;
}

/// Evaluates (2), from x_ = Y b.
bool ForceBounds::contract() {
  for (Vector* of_unknowns : {&x_0_, &d_, &e_, &next_}) of_unknowns->resize(size_);
  for (Eigen::Index l = 0; l < size_; ++l) x_0_[l] = x_[l].middle();
  if (!x_0_.allFinite()) return false;
  for (Eigen::Index k = 0; k < size_; ++k) {  // b - K x_0
    for (Eigen::Index l = 0; l < size_; ++l) b_[l] = b_[l] - K_[l + k * size_] * Interval(x_0_[k]);
  }
  E_.resize(size_, size_);
  for (Eigen::Index l = 0; l < size_; ++l) {
    Interval sum = 0.0;
    for (Eigen::Index k = 0; k < size_; ++k) sum += Interval(Y_(l, k)) * b_[k];
    d_[l] = sum.magnitude();
    for (Eigen::Index column = 0; column < size_; ++column) {
      Interval entry = l == column ? 1.0 : 0.0;
      for (Eigen::Index k = 0; k < size_; ++k) {
        if (Y_(l, k) != 0) entry = entry - Interval(Y_(l, k)) * K_[k + column * size_];
      }
      E_(l, column) = entry.magnitude();
    }
  }
  if (!d_.allFinite() || !E_.allFinite()) return false;
  e_ = d_;
  for (int iteration = 0; iteration < kTestIterations; ++iteration) {
    next_.noalias() = E_ * e_;
    next_ += d_;
    if ((next_.array() <= e_.array() * (1 - kInverseRounding)).all()) {
      for (Eigen::Index l = 0; l < size_; ++l) x_[l] = Interval(x_0_[l]) + Interval(-e_[l], e_[l]);
      return true;
    }
    e_ = 1.1 * next_ + Vector::Constant(size_, 1e-300);
  }
  return false;
}

Interval ForceBounds::cone_margin(int contact) const {
  const auto& info = info_.contacts[contact];
  const int row = row_[contact];
  Interval tangential = 0.0;
  if (info.n_t == 1) {
    tangential = abs(x_[row + 1]);
  } else {
    for (int k = 0; k < info.n_t; ++k) tangential += square(x_[row + 1 + k]);
    tangential = sqrt(tangential);
  }
  return Interval(info.mu) * x_[row] - tangential;
}

}  // namespace ricochet
