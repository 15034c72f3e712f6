#include "methods/time_freezing/pseudo_time_element.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;
// A pivot of redundant contacts, relative to its column: rounding.
constexpr double kDependent = 1e-12;
// Newton's corrections may stall at the rounding of the equations of index 2, divided by h.
constexpr double kStalled = 1e-9;
// What factors have to make of a correction, or there are new ones.
constexpr double kContraction = 0.02;
constexpr int kMaxCorrections = 4;

}  // namespace

PseudoTimeElement::PseudoTimeElement(const Problem& problem, const ButcherTableau& tableau,
                                     const AuxiliaryDynamics& auxiliary, double tolerance, Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      tableau_(tableau),
      auxiliary_(auxiliary),
      tolerance_(tolerance),
      counters_(counters),
      is_stiffly_accurate_(tableau.is_stiffly_accurate()) {
  const int n_q = info_.n_q, n_c = info_.n_c(), n_s = tableau.n_s;
  q0 = v0 = q1 = v1 = f_ = Vector::Zero(n_q);
  y0 = y1 = Lambda_n = lambda_n_ = weight_ = Vector::Zero(n_c);
  Lambda_t = lambda_t_ = Vector::Zero(info_.n_lambda_t);
  q = v = w = dv_dh_ = dq_dh_ = Matrix::Zero(n_q, n_s);
  y = beta = Matrix::Zero(n_c, n_s);
  tau = Matrix::Zero(info_.n_lambda_t, n_s);
  s = Vector::Ones(n_s);
  packed_n_.resize(info_.n_normal_entries);
  packed_t_.resize(info_.n_tangent_entries);
  M_ = f_q_ = f_v_ = H_ = Matrix::Zero(n_q, n_q);
  T_ = Matrix::Zero(info_.n_lambda_t, n_q);
  regions_.of.resize(info_.contacts.size());
}

/// Whether two sets of regions have the same equations, but for the direction of slip that turns.
bool PseudoTimeElement::is_same(const Regions& regions) const {
  if (regions.is_frozen != regions_.is_frozen) return false;
  for (std::size_t i = 0; i < regions.of.size(); ++i) {
    const ContactRegion &a = regions.of[i], &b = regions_.of[i];
    if (a.region != b.region || a.sticks != b.sticks || a.turns != b.turns) return false;
    if (!a.turns && a.direction != b.direction) return false;
  }
  return true;
}

void PseudoTimeElement::set_regions(const Regions& regions) {
  const bool is_known = K_.size() > 0 && is_same(regions);
  regions_ = regions;
  if (is_known) return;
  has_factors_ = false;
  held_.clear();
  n_rows_ = 0;
  has_curved_ = has_friction_ = false;
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactInfo& contact = info_.contacts[i];
    if (!contact.is_bilateral && !regions.of[i].is_held()) continue;
    held_.push_back({i, n_rows_, contact.is_bilateral});
    n_rows_ += 1 + (regions.of[i].sticks ? contact.n_t : 0);
    has_curved_ = has_curved_ || !contact.is_affine;
    has_friction_ = has_friction_ || contact.n_t > 0;
  }
  const int n_q = info_.n_q;
  n_stage_ = n_q + 1 + n_rows_;
  const int n = tableau_.n_s * n_stage_ + (regions.is_frozen ? 0 : 1);
  K_.resize(n, n);
  r_.resize(n);
  x_.resize(n);
  R_q_.resize(n_stage_, n_q);
  R_v_.resize(n_stage_, n_q);
  R_w_.resize(n_stage_, n_q);
  R_s_.resize(n_stage_, 1);
  R_x_.resize(n_stage_, n_rows_);
}

void PseudoTimeElement::guess(double length, double rate, const Vector& derivative, const Vector& weights,
                              const Vector& tangential) {
  h = length;
  for (int j = 0; j < tableau_.n_s; ++j) {
    s[j] = rate;
    w.col(j) = derivative;
    beta.col(j) = weights;
    tau.col(j) = tangential;
  }
}

void PseudoTimeElement::continue_guess() {
  const int last = tableau_.n_s - 1;
  guess(h, s[last], Vector(w.col(last)), Vector(beta.col(last)), Vector(tau.col(last)));
}

bool PseudoTimeElement::solve_to_clock(double dt) {
  return newton(dt, 0);
}

bool PseudoTimeElement::solve_length(double length) {
  h = length;
  return newton(0, length);
}

/// The stages of the unknowns at hand, and what h does to them:
///
///   d v_j / d h = sum_k a_jk w_k,   d q_j / d h = sum_k a_jk s_k (v_k + h d v_k / d h)                      (10)
///
/// By plain loops: Eigen's take longer than the sums for these sizes.
void PseudoTimeElement::set_stages() {
  const Eigen::Index n_q = info_.n_q, n_s = tableau_.n_s;
  const Matrix& A = tableau_.A;
  for (Eigen::Index j = 0; j < n_s; ++j) {
    double *dv = dv_dh_.data() + j * n_q, *v_j = v.data() + j * n_q;
    std::fill_n(dv, n_q, 0.0);
    for (Eigen::Index k = 0; k < n_s; ++k) {
      const double a = A(j, k), *w_k = w.data() + k * n_q;
      for (Eigen::Index i = 0; i < n_q; ++i) dv[i] += a * w_k[i];
    }
    for (Eigen::Index i = 0; i < n_q; ++i) v_j[i] = v0[i] + h * dv[i];
  }
  for (Eigen::Index j = 0; j < n_s; ++j) {
    double *dq = dq_dh_.data() + j * n_q, *q_j = q.data() + j * n_q;
    std::fill_n(dq, n_q, 0.0);
    std::copy_n(q0.data(), n_q, q_j);
    for (Eigen::Index k = 0; k < n_s; ++k) {
      const double a = A(j, k) * s[k], *v_k = v.data() + k * n_q, *dv = dv_dh_.data() + k * n_q;
      for (Eigen::Index i = 0; i < n_q; ++i) {
        q_j[i] += h * a * v_k[i];
        dq[i] += a * (v_k[i] + h * dv[i]);
      }
    }
  }
}

/// (8): the direction in which a slipping contact has slip velocity v_t, with the sign that it has at the left end.
/// @return |v_t| with that sign where the direction turns with it, else 0
double PseudoTimeElement::slip_direction(const Held& held, int j, double* d) const {
  const ContactInfo& contact = info_.contacts[held.contact];
  const ContactRegion& region = regions_.of[held.contact];
  std::copy_n(region.direction.data(), 2, d);
  if (!region.turns) return 0;
  const double* J_t = packed_t_.data() + contact.tangent_begin;
  const double v_t[2]{packed_dot(contact, J_t, v.col(j)), packed_dot(contact, J_t + contact.support.size(), v.col(j))};
  const double speed = std::copysign(std::hypot(v_t[0], v_t[1]), v_t[0] * d[0] + v_t[1] * d[1]);
  if (speed == 0) return 0;
  d[0] = v_t[0] / speed;
  d[1] = v_t[1] / speed;
  return speed;
}

/// Residual of stage j; leaves M, f, the Jacobians and the forces there.
void PseudoTimeElement::set_residual(int j) {
  const int n_q = info_.n_q;
  const double* const at = q.col(j).data();
  const auto stage_v = v.col(j), stage_w = w.col(j);
  if (!info_.structure.constant_mass || !has_mass_) problem_.mass_matrix(at, M_.data());
  has_mass_ = true;
  problem_.force(at, stage_v.data(), info_.u.data(), f_.data());
  ++counters_.force_evaluations;
  load_ = std::max(load_, f_.cwiseQuotient(M_.diagonal()).lpNorm<Eigen::Infinity>());
  problem_.normal_jacobian(at, packed_n_.data());
  if (has_friction_) problem_.tangent_jacobian(at, packed_t_.data());

  auto r = r_.segment(j * n_stage_, n_stage_);
  r.head(n_q).noalias() = M_.lazyProduct(stage_w);
  r.head(n_q) -= s[j] * f_;
  double product = regions_.is_frozen ? 0 : 1;  // (3)
  for (const Held& held : held_) {
    const int i = held.contact, row = n_q + 1 + held.row;
    const ContactInfo& contact = info_.contacts[i];
    const ContactRegion& region = regions_.of[i];
    const double* J_n = packed_n_.data() + contact.normal_begin;
    const double push = auxiliary_.push[i];
    if (!held.is_bilateral) product *= 1 - beta(i, j);
    if (held.is_bilateral || region.region == Region::sliding) {
      r[row] = packed_dot(contact, J_n, stage_v);  // (4)
    } else if (region.region == Region::pushed) {
      r[row] = beta(i, j) - 1;  // (5)
    } else {
      r[row] = packed_dot(contact, J_n, stage_w) + auxiliary_.k * y(i, j) +
               auxiliary_.damping[i] * packed_dot(contact, J_n, stage_v);  // (6)
    }
    const auto pushed = contact.pushed();
    lambda_n_[i] = push * beta(i, j);
    for (std::size_t e = 0; e < pushed.size(); ++e) r[pushed[e]] -= lambda_n_[i] * J_n[e];
    double d[2]{0, 0};
    if (region.slips()) slip_direction(held, j, d);
    for (int c = 0; c < contact.n_t; ++c) {
      const int k = contact.tangent_index + c;
      const double* J_t = packed_t_.data() + contact.tangent_begin + c * static_cast<int>(contact.support.size());
      if (region.sticks) {
        r[row + 1 + c] = packed_dot(contact, J_t, stage_v);  // (7)
      } else {
        tau(k, j) = -contact.mu * beta(i, j) * d[c];  // (8)
      }
      lambda_t_[k] = push * tau(k, j);
      for (std::size_t e = 0; e < pushed.size(); ++e) r[pushed[e]] -= lambda_t_[k] * J_t[e];
    }
  }
  r[n_q] = s[j] - product;
}

/// Partial derivatives of the rows of a contact at stage j, behind set_residual().
void PseudoTimeElement::set_contact_derivatives(int j, const Held& held) {
  const int i = held.contact, n_q = info_.n_q, row = n_q + 1 + held.row;
  const ContactInfo& contact = info_.contacts[i];
  const ContactRegion& region = regions_.of[i];
  const auto size = static_cast<int>(contact.support.size());
  const double* J_n = packed_n_.data() + contact.normal_begin;
  const double push = auxiliary_.push[i];
  const auto pushed = contact.pushed();
  const auto set = [&](Matrix& R, int to, const double* J, double factor) {
    for (int e = 0; e < size; ++e) R(to, contact.support[e]) = factor * J[e];
  };
  if (held.is_bilateral || region.region == Region::sliding) {  // (4)
    set(R_v_, row, J_n, 1);
    if (!contact.is_affine) {
      weight_.setZero();
      weight_[i] = 1;
      problem_.gap_hessian(q.col(j).data(), weight_.data(), H_.data());
      R_q_.row(row).noalias() = v.col(j).transpose().lazyProduct(H_);
    }
  } else if (region.region == Region::pushed) {  // (5)
    R_x_(row, held.row) = 1;
  } else {  // (6), but for y
    set(R_w_, row, J_n, 1);
    set(R_v_, row, J_n, auxiliary_.damping[i]);
  }
  if (!held.is_bilateral && !regions_.is_frozen) {  // (3)
    double others = 1;
    for (const Held& other : held_) {
      if (other.contact != i && !other.is_bilateral) others *= 1 - beta(other.contact, j);
    }
    R_x_(n_q, held.row) = others;
  }
  for (std::size_t e = 0; e < pushed.size(); ++e) R_x_(pushed[e], held.row) = -push * J_n[e];
  double d[2]{0, 0};
  const double speed = region.slips() ? slip_direction(held, j, d) : 0;
  for (int c = 0; c < contact.n_t; ++c) {
    const double* J_t = packed_t_.data() + contact.tangent_begin + c * size;
    if (region.sticks) {
      set(R_v_, row + 1 + c, J_t, 1);  // (7)
      if (!contact.is_affine) R_q_.row(row + 1 + c) = T_.row(contact.tangent_index + c);
      for (std::size_t e = 0; e < pushed.size(); ++e) R_x_(pushed[e], held.row + 1 + c) = -push * J_t[e];
      continue;
    }
    for (std::size_t e = 0; e < pushed.size(); ++e) R_x_(pushed[e], held.row) += push * contact.mu * d[c] * J_t[e];
    if (speed == 0) continue;
    for (int b = 0; b < 2; ++b) {  // (8): d by v_t is (1 - d d') / |v_t|
      const double turn = push * contact.mu * beta(i, j) * ((b == c ? 1 : 0) - d[b] * d[c]) / speed;
      const double* J_b = packed_t_.data() + contact.tangent_begin + b * size;
      for (std::size_t e = 0; e < pushed.size(); ++e) {
        for (int k = 0; k < size; ++k) R_v_(pushed[e], contact.support[k]) += turn * J_t[e] * J_b[k];
        if (!contact.is_affine) R_q_.row(pushed[e]) += turn * J_t[e] * T_.row(contact.tangent_index + b);
      }
    }
  }
}

/// Rows of the Newton matrix of stage j, behind set_residual().
void PseudoTimeElement::set_derivatives(int j) {
  const int n_q = info_.n_q, n_s = tableau_.n_s, first = j * n_stage_;
  const Matrix& A = tableau_.A;
  const double* const at = q.col(j).data();
  for (Matrix* part : {&R_q_, &R_v_, &R_w_, &R_s_, &R_x_}) part->setZero();
  problem_.force_jacobians(at, v.col(j).data(), info_.u.data(), f_q_.data(), f_v_.data());
  ++counters_.jacobian_evaluations;
  R_q_.topRows(n_q) = -s[j] * f_q_;
  R_v_.topRows(n_q) = -s[j] * f_v_;
  R_w_.topRows(n_q) = M_;
  R_s_.topRows(n_q) = -f_;
  R_s_(n_q, 0) = 1;
  if (!info_.structure.constant_mass) {
    problem_.mass_derivative(at, w.col(j).data(), H_.data());
    R_q_.topRows(n_q) += H_;
  }
  if (has_curved_) {
    problem_.contact_force_derivative(at, lambda_n_.data(), lambda_t_.data(), H_.data());
    R_q_.topRows(n_q) -= H_;
    if (has_friction_) problem_.slip_velocity_derivative(at, v.col(j).data(), T_.data());
  }
  if (info_.clock >= 0) {
    R_q_.row(info_.clock).setZero();
    R_v_.row(info_.clock).setZero();
  }
  for (const Held& held : held_) set_contact_derivatives(j, held);

  // By the chain rule: v_j by w_l is h a_jl, q_j by w_l is h^2 (A diag(s) A)_jl, q_j by s_l is h a_jl v_l.
  for (int l = 0; l < n_s; ++l) {
    double twice = 0, squared = 0;
    for (int k = 0; k < n_s; ++k) {
      twice += A(j, k) * s[k] * A(k, l);
      squared += A(j, k) * A(k, l);
    }
    auto block = K_.block(first, l * n_stage_, n_stage_, n_stage_);
    block.setZero();
    block.leftCols(n_q) = (h * A(j, l)) * R_v_ + (h * h * twice) * R_q_;
    block.col(n_q).noalias() = R_q_.lazyProduct((h * A(j, l)) * v.col(l));
    if (l == j) {
      block.leftCols(n_q) += R_w_;
      block.col(n_q) += R_s_;
      block.rightCols(n_rows_) = R_x_;
    }
    for (const Held& held : held_) {  // y_j of (6) by w_l
      const int i = held.contact;
      if (held.is_bilateral || regions_.of[i].region != Region::bouncing) continue;
      const ContactInfo& contact = info_.contacts[i];
      const double* J = packed_n_.data() + contact.normal_begin;
      for (std::size_t e = 0; e < contact.support.size(); ++e)
        block(n_q + 1 + held.row, contact.support[e]) += auxiliary_.k * h * h * squared * J[e];
    }
  }
  if (!regions_.is_frozen) {
    auto by_h = K_.col(K_.cols() - 1).segment(first, n_stage_);
    by_h.noalias() = R_v_.lazyProduct(dv_dh_.col(j));
    by_h.noalias() += R_q_.lazyProduct(dq_dh_.col(j));
  }
}

/// y of (6) at the stages. q stands still, and J_n with it.
void PseudoTimeElement::set_depths() {
  for (const Held& held : held_) {
    const int i = held.contact;
    if (held.is_bilateral || regions_.of[i].region != Region::bouncing) continue;
    const double* J = packed_n_.data() + info_.contacts[i].normal_begin;
    for (int j = 0; j < tableau_.n_s; ++j) {
      y(i, j) = y0[i];
      for (int k = 0; k < tableau_.n_s; ++k)
        y(i, j) += h * tableau_.A(j, k) * packed_dot(info_.contacts[i], J, v.col(k));
    }
  }
}

/// Newton's method, with the factors of an earlier element as long as they contract.
bool PseudoTimeElement::newton(double dt, double length) {
  const int n_s = tableau_.n_s;
  const bool has_clock = !regions_.is_frozen;
  if (!has_clock) {
    h = length;
    s.setZero();
    if (!held_.empty()) problem_.normal_jacobian(q0.data(), packed_n_.data());
  }
  bool contracts = true;
  double last = INFINITY;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    const bool refresh = !has_factors_ || is_redundant_ || !contracts;
    set_stages();
    set_depths();
    load_ = 0;
    for (int j = 0; j < n_s; ++j) {
      set_residual(j);
      if (refresh) set_derivatives(j);
    }
    if (has_clock) r_[r_.size() - 1] = h * tableau_.b.dot(s) - dt;  // (9)
    if (!r_.allFinite()) return false;
    if (refresh) factorize();
    if (is_redundant_) {
      x_ = least_squares(K_, r_);
    } else {
      x_ = r_;
      lu_.solve_in_place(x_.data());
    }
    ++counters_.inner_iterations;
    ++counters_.linear_solves;
    if (!x_.allFinite()) return has_factors_ = false;
    // What comes to rest, or stays there, is compared with what its load would do.
    double size = std::max({v0.lpNorm<Eigen::Infinity>(), h * load_, std::numeric_limits<double>::min()});
    const double change = apply_correction(dt, size);
    if (change <= tolerance_ * size || (change <= kStalled * size && change >= 0.5 * last)) {
      set_right_end();
      return q1.allFinite() && v1.allFinite();
    }
    contracts = iteration == 0 || change <= kContraction * last;
    last = change;
  }
  return has_factors_ = false;
}

void PseudoTimeElement::factorize() {
  if (!regions_.is_frozen) {
    const Eigen::Index end = r_.size() - 1;
    K_.row(end).setZero();
    for (int j = 0; j < tableau_.n_s; ++j) K_(end, j * n_stage_ + info_.n_q) = h * tableau_.b[j];
    K_(end, end) = tableau_.b.dot(s);
  }
  lu_.factorize(K_);
  ++counters_.matrix_factorizations;
  is_redundant_ = !(lu_.smallest_pivot() > kDependent);
  has_factors_ = true;
}

/// Subtracts x_. @param size  of velocities, raised @return the largest change of a velocity
double PseudoTimeElement::apply_correction(double dt, double& size) {
  const int n_q = info_.n_q;
  double change = 0;
  for (int j = 0; j < tableau_.n_s; ++j) {
    const auto x = x_.segment(j * n_stage_, n_stage_);
    w.col(j) -= x.head(n_q);
    s[j] -= x[n_q];
    change = std::max(change, h * x.head(n_q).lpNorm<Eigen::Infinity>());
    size = std::max(size, h * w.col(j).lpNorm<Eigen::Infinity>());
    for (const Held& held : held_) {
      const ContactInfo& contact = info_.contacts[held.contact];
      beta(held.contact, j) -= x[n_q + 1 + held.row];
      if (!regions_.of[held.contact].sticks) continue;
      for (int d = 0; d < contact.n_t; ++d) tau(contact.tangent_index + d, j) -= x[n_q + 2 + held.row + d];
    }
  }
  if (regions_.is_frozen) return change;
  const double dh = x_[x_.size() - 1];
  h -= dh;
  return std::max(change, std::abs(dh) / dt * size);
}

void PseudoTimeElement::set_right_end() {
  const int n_s = tableau_.n_s;
  const Vector& b = tableau_.b;
  set_stages();
  q1 = q0;
  v1 = v0;
  y1 = y0;
  for (int j = 0; j < n_s; ++j) {
    q1 += (h * b[j] * s[j]) * v.col(j);
    v1 += (h * b[j]) * w.col(j);
  }
  Lambda_n.setZero();
  Lambda_t.setZero();
  for (const Held& held : held_) {
    const int i = held.contact;
    const ContactInfo& contact = info_.contacts[i];
    for (int j = 0; j < n_s; ++j) {
      Lambda_n[i] += h * b[j] * auxiliary_.push[i] * beta(i, j);
      for (int d = 0; d < contact.n_t; ++d) {
        double& part = tau(contact.tangent_index + d, j);
        if (!regions_.of[i].sticks && !regions_.of[i].slips()) part = 0;
        Lambda_t[contact.tangent_index + d] += h * b[j] * auxiliary_.push[i] * part;
      }
      if (regions_.of[i].region == Region::bouncing)
        y1[i] += h * b[j] * packed_dot(contact, packed_n_.data() + contact.normal_begin, v.col(j));
    }
  }
  if (held_.empty() || regions_.is_frozen) return;
  if (has_curved_ || !is_stiffly_accurate_) correct_right_end();
}

/// The auxiliary dynamics at the right end: f_c = 0 by the directions M^-1 J_n where a contact is curved, then (4), (7).
void PseudoTimeElement::correct_right_end() {
  problem_.mass_matrix(q1.data(), M_.data());
  Vector violation = Vector::Zero(n_rows_), gap(info_.n_c());
  if (has_curved_) {
    for (int k = 0; k < kMaxCorrections; ++k) {
      problem_.gap(q1.data(), gap.data());
      double largest = 0;
      for (const Held& held : held_) {
        violation[held.row] = gap[held.contact];
        largest = std::max(largest, std::abs(gap[held.contact]));
      }
      if (!correct(violation, true) || largest < 1e-15 * q1.lpNorm<Eigen::Infinity>()) break;
    }
  }
  problem_.normal_jacobian(q1.data(), packed_n_.data());
  if (has_friction_) problem_.tangent_jacobian(q1.data(), packed_t_.data());
  for (const Held& held : held_) {
    const ContactInfo& contact = info_.contacts[held.contact];
    violation[held.row] = packed_dot(contact, packed_n_.data() + contact.normal_begin, v1);
    if (!regions_.of[held.contact].sticks) continue;
    for (int d = 0; d < contact.n_t; ++d) {
      const double* J = packed_t_.data() + contact.tangent_begin + d * static_cast<int>(contact.support.size());
      violation[held.row + 1 + d] = packed_dot(contact, J, v1);
    }
  }
  correct(violation, false);
}

/// One step of Newton's method at the right end. @param positions  of q1 along the normals, else of v1 along all
bool PseudoTimeElement::correct(const Vector& violation, bool positions) {
  const int n_q = info_.n_q;
  if (positions) problem_.normal_jacobian(q1.data(), packed_n_.data());
  Matrix R = Matrix::Zero(n_q, n_rows_), C = Matrix::Zero(n_q, n_rows_);
  const auto add = [&](Matrix& to, const ContactInfo& contact, const double* J, int column_of, double factor,
                       bool with_clock) {
    const std::size_t size = with_clock ? contact.support.size() : contact.pushed().size();
    for (std::size_t e = 0; e < size; ++e) to(contact.support[e], column_of) += factor * J[e];
  };
  for (const Held& held : held_) {
    const ContactInfo& contact = info_.contacts[held.contact];
    const ContactRegion& region = regions_.of[held.contact];
    const double* J_n = packed_n_.data() + contact.normal_begin;
    add(R, contact, J_n, held.row, 1, true);
    add(C, contact, J_n, held.row, 1, false);
    if (positions) continue;
    for (int d = 0; d < contact.n_t; ++d) {
      const double* J = packed_t_.data() + contact.tangent_begin + d * static_cast<int>(contact.support.size());
      if (region.sticks) {
        add(R, contact, J, held.row + 1 + d, 1, true);
        add(C, contact, J, held.row + 1 + d, 1, false);
      } else if (region.slips()) {
        add(C, contact, J, held.row, -contact.mu * region.direction[d], false);
      }
    }
  }
  const Matrix X = CholeskyFactors(M_).solve_columns(C);
  const Vector nu = least_squares(R.transpose() * X, violation);
  if (!nu.allFinite()) return false;
  (positions ? q1 : v1) -= X * nu;
  return true;
}

}  // namespace ricochet
