#include "methods/time_freezing/pseudo_time_equations.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {

PseudoTimeEquations::PseudoTimeEquations(const Problem& problem, const ButcherTableau& tableau,
                                         const AuxiliaryDynamics& auxiliary, const HeldContacts& held,
                                         Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      tableau_(tableau),
      auxiliary_(auxiliary),
      held_(held),
      counters_(counters) {
  f_q_ = f_v_ = H_ = Matrix::Zero(info_.n_q, info_.n_q);
  T_ = Matrix::Zero(info_.n_lambda_t, info_.n_q);
  weight_ = Vector::Zero(info_.n_c());
}

void PseudoTimeEquations::prepare(PseudoTimeWorkspace& work) const {
  work.f = Vector::Zero(info_.n_q);
  work.M = Matrix::Zero(info_.n_q, info_.n_q);
  work.dq_dh = work.dv_dh = Matrix::Zero(info_.n_q, tableau_.n_s);
  work.J_n.resize(info_.n_normal_entries);
  work.J_t.resize(info_.n_tangent_entries);
  work.lambda_n = Vector::Zero(info_.n_c());
  work.lambda_t = Vector::Zero(info_.n_lambda_t);
}

void PseudoTimeEquations::resize(PseudoTimeWorkspace& work) {
  work.K.resize(held_.n_unknowns(), held_.n_unknowns());
  work.r.resize(held_.n_unknowns());
  for (Matrix* part : {&R_.q, &R_.v, &R_.w}) part->resize(held_.n_stage(), info_.n_q);
  R_.s.resize(held_.n_stage(), 1);
  R_.x.resize(held_.n_stage(), held_.n_rows());
}

void PseudoTimeEquations::begin(PseudoTimeElement& e, PseudoTimeWorkspace& work) const {
  if (!held_.is_frozen()) return;
  e.s.setZero();
  if (!held_.all().empty()) problem_.normal_jacobian(e.q0.data(), work.J_n.data());
}

/// Plain loops: those of Eigen take longer than the sums for these sizes.
void PseudoTimeEquations::set_stages(PseudoTimeElement& e, PseudoTimeWorkspace& work) const {
  const Eigen::Index n_q = info_.n_q, n_s = tableau_.n_s;
  const Matrix& A = tableau_.A;
  for (Eigen::Index j = 0; j < n_s; ++j) {
    double *dv = work.dv_dh.data() + j * n_q, *v_j = e.v.data() + j * n_q;
    std::fill_n(dv, n_q, 0.0);
    for (Eigen::Index k = 0; k < n_s; ++k) {
      const double a = A(j, k), *w_k = e.w.data() + k * n_q;
      for (Eigen::Index i = 0; i < n_q; ++i) dv[i] += a * w_k[i];
    }
    for (Eigen::Index i = 0; i < n_q; ++i) v_j[i] = e.v0[i] + e.h * dv[i];
  }
  for (Eigen::Index j = 0; j < n_s; ++j) {
    double *dq = work.dq_dh.data() + j * n_q, *q_j = e.q.data() + j * n_q;
    std::fill_n(dq, n_q, 0.0);
    std::copy_n(e.q0.data(), n_q, q_j);
    for (Eigen::Index k = 0; k < n_s; ++k) {
      const double a = A(j, k) * e.s[k], *v_k = e.v.data() + k * n_q, *dv = work.dv_dh.data() + k * n_q;
      for (Eigen::Index i = 0; i < n_q; ++i) {
        q_j[i] += e.h * a * v_k[i];
        dq[i] += a * (v_k[i] + e.h * dv[i]);
      }
    }
  }
  set_depths(e, work);
}

/// y of (6) at the stages. q stands still, and J_n with it.
void PseudoTimeEquations::set_depths(PseudoTimeElement& e, const PseudoTimeWorkspace& work) const {
  for (const HeldContact& held : held_.all()) {
    if (!held_.bounces(held)) continue;
    const int i = held.contact;
    const double* J = work.J_n.data() + info_.contacts[i].normal_begin;
    for (int j = 0; j < tableau_.n_s; ++j) {
      e.y(i, j) = e.y0[i];
      for (int k = 0; k < tableau_.n_s; ++k)
        e.y(i, j) += e.h * tableau_.A(j, k) * packed_dot(info_.contacts[i], J, e.v.col(k));
    }
  }
}

/// (8): the direction in which a slipping contact has slip velocity v_t, with the sign that it has at the left end.
/// @return |v_t| with that sign where the direction turns with it, else 0
double PseudoTimeEquations::slip_direction(const HeldContact& held, int j, const PseudoTimeElement& e,
                                           const PseudoTimeWorkspace& work, double* d) const {
  const ContactInfo& contact = info_.contacts[held.contact];
  const ContactRegion& region = held_.region(held);
  std::copy_n(region.direction.data(), 2, d);
  if (!region.turns) return 0;
  const double* J_t = work.J_t.data() + contact.tangent_begin;
  const double v_t[2]{packed_dot(contact, J_t, e.v.col(j)),
                      packed_dot(contact, J_t + contact.support.size(), e.v.col(j))};
  const double speed = std::copysign(std::hypot(v_t[0], v_t[1]), v_t[0] * d[0] + v_t[1] * d[1]);
  if (speed == 0) return 0;
  d[0] = v_t[0] / speed;
  d[1] = v_t[1] / speed;
  return speed;
}

/// Residual of stage j; leaves M, f, the Jacobians and the forces there.
void PseudoTimeEquations::set_residual(int j, PseudoTimeElement& e, PseudoTimeWorkspace& work) const {
  const int n_q = info_.n_q;
  const double* const at = e.q.col(j).data();
  const auto stage_v = e.v.col(j), stage_w = e.w.col(j);
  if (!info_.structure.constant_mass || !work.has_mass) problem_.mass_matrix(at, work.M.data());
  work.has_mass = true;
  problem_.force(at, stage_v.data(), info_.u.data(), work.f.data());
  ++counters_.force_evaluations;
  work.load = std::max(work.load, work.f.cwiseQuotient(work.M.diagonal()).lpNorm<Eigen::Infinity>());
  problem_.normal_jacobian(at, work.J_n.data());
  if (held_.has_friction()) problem_.tangent_jacobian(at, work.J_t.data());

  auto r = work.r.segment(j * held_.n_stage(), held_.n_stage());
  r.head(n_q).noalias() = work.M.lazyProduct(stage_w);
  r.head(n_q) -= e.s[j] * work.f;
  double product = held_.is_frozen() ? 0 : 1;  // (3)
  for (const HeldContact& held : held_.all()) {
    const int i = held.contact, row = held_.row_of(held);
    const ContactInfo& contact = info_.contacts[i];
    const ContactRegion& region = held_.region(held);
    const double* J_n = work.J_n.data() + contact.normal_begin;
    const double push = auxiliary_.push[i];
    if (!held.is_bilateral) product *= 1 - e.beta(i, j);
    if (held_.slides(held)) {
      r[row] = packed_dot(contact, J_n, stage_v);  // (4)
    } else if (region.region == Region::pushed) {
      r[row] = e.beta(i, j) - 1;  // (5)
    } else {
      r[row] = packed_dot(contact, J_n, stage_w) + auxiliary_.k * e.y(i, j) +
               auxiliary_.damping[i] * packed_dot(contact, J_n, stage_v);  // (6)
    }
    const auto pushed = contact.pushed();
    work.lambda_n[i] = push * e.beta(i, j);
    for (std::size_t p = 0; p < pushed.size(); ++p) r[pushed[p]] -= work.lambda_n[i] * J_n[p];
    double d[2]{0, 0};
    if (region.slips()) slip_direction(held, j, e, work, d);
    for (int c = 0; c < contact.n_t; ++c) {
      const int k = contact.tangent_index + c;
      const double* J_t = work.J_t.data() + contact.tangent_begin + c * static_cast<int>(contact.support.size());
      if (region.sticks) {
        r[row + 1 + c] = packed_dot(contact, J_t, stage_v);  // (7)
      } else {
        e.tau(k, j) = -contact.mu * e.beta(i, j) * d[c];  // (8)
      }
      work.lambda_t[k] = push * e.tau(k, j);
      for (std::size_t p = 0; p < pushed.size(); ++p) r[pushed[p]] -= work.lambda_t[k] * J_t[p];
    }
  }
  r[n_q] = e.s[j] - product;
}

/// Partial derivatives of the rows of a contact at stage j, after set_residual().
void PseudoTimeEquations::set_contact_derivatives(int j, const HeldContact& held, const PseudoTimeElement& e,
                                                  const PseudoTimeWorkspace& work) {
  const int i = held.contact, n_q = info_.n_q, row = held_.row_of(held);
  const ContactInfo& contact = info_.contacts[i];
  const ContactRegion& region = held_.region(held);
  const auto size = static_cast<int>(contact.support.size());
  const double* J_n = work.J_n.data() + contact.normal_begin;
  const double push = auxiliary_.push[i];
  const auto pushed = contact.pushed();
  const auto set = [&](Matrix& R, int to, const double* J, double factor) {
    for (int p = 0; p < size; ++p) R(to, contact.support[p]) = factor * J[p];
  };
  if (held_.slides(held)) {  // (4)
    set(R_.v, row, J_n, 1);
    if (!contact.is_affine) {
      weight_.setZero();
      weight_[i] = 1;
      problem_.gap_hessian(e.q.col(j).data(), weight_.data(), H_.data());
      R_.q.row(row).noalias() = e.v.col(j).transpose().lazyProduct(H_);
    }
  } else if (region.region == Region::pushed) {  // (5)
    R_.x(row, held.row) = 1;
  } else {  // (6), but for y
    set(R_.w, row, J_n, 1);
    set(R_.v, row, J_n, auxiliary_.damping[i]);
  }
  if (!held.is_bilateral && !held_.is_frozen()) {  // (3)
    double others = 1;
    for (const HeldContact& other : held_.all()) {
      if (other.contact != i && !other.is_bilateral) others *= 1 - e.beta(other.contact, j);
    }
    R_.x(n_q, held.row) = others;
  }
  for (std::size_t p = 0; p < pushed.size(); ++p) R_.x(pushed[p], held.row) = -push * J_n[p];
  double d[2]{0, 0};
  const double speed = region.slips() ? slip_direction(held, j, e, work, d) : 0;
  for (int c = 0; c < contact.n_t; ++c) {
    const double* J_t = work.J_t.data() + contact.tangent_begin + c * size;
    if (region.sticks) {
      set(R_.v, row + 1 + c, J_t, 1);  // (7)
      if (!contact.is_affine) R_.q.row(row + 1 + c) = T_.row(contact.tangent_index + c);
      for (std::size_t p = 0; p < pushed.size(); ++p) R_.x(pushed[p], held.row + 1 + c) = -push * J_t[p];
      continue;
    }
    for (std::size_t p = 0; p < pushed.size(); ++p) R_.x(pushed[p], held.row) += push * contact.mu * d[c] * J_t[p];
    if (speed == 0) continue;
    for (int b = 0; b < 2; ++b) {  // (8): d by v_t is (1 - d d') / |v_t|
      const double turn = push * contact.mu * e.beta(i, j) * ((b == c ? 1 : 0) - d[b] * d[c]) / speed;
      const double* J_b = work.J_t.data() + contact.tangent_begin + b * size;
      for (std::size_t p = 0; p < pushed.size(); ++p) {
        for (int k = 0; k < size; ++k) R_.v(pushed[p], contact.support[k]) += turn * J_t[p] * J_b[k];
        if (!contact.is_affine) R_.q.row(pushed[p]) += turn * J_t[p] * T_.row(contact.tangent_index + b);
      }
    }
  }
}

/// Rows of the Newton matrix of stage j, after set_residual().
void PseudoTimeEquations::set_derivatives(int j, const PseudoTimeElement& e, PseudoTimeWorkspace& work) {
  const int n_q = info_.n_q, n_s = tableau_.n_s, first = j * held_.n_stage();
  const Matrix& A = tableau_.A;
  const double* const at = e.q.col(j).data();
  for (Matrix* part : {&R_.q, &R_.v, &R_.w, &R_.s, &R_.x}) part->setZero();
  problem_.force_jacobians(at, e.v.col(j).data(), info_.u.data(), f_q_.data(), f_v_.data());
  ++counters_.jacobian_evaluations;
  R_.q.topRows(n_q) = -e.s[j] * f_q_;
  R_.v.topRows(n_q) = -e.s[j] * f_v_;
  R_.w.topRows(n_q) = work.M;
  R_.s.topRows(n_q) = -work.f;
  R_.s(n_q, 0) = 1;
  if (!info_.structure.constant_mass) {
    problem_.mass_derivative(at, e.w.col(j).data(), H_.data());
    R_.q.topRows(n_q) += H_;
  }
  if (held_.has_curved()) {
    problem_.contact_force_derivative(at, work.lambda_n.data(), work.lambda_t.data(), H_.data());
    R_.q.topRows(n_q) -= H_;
    if (held_.has_friction()) problem_.slip_velocity_derivative(at, e.v.col(j).data(), T_.data());
  }
  if (info_.clock >= 0) {
    R_.q.row(info_.clock).setZero();
    R_.v.row(info_.clock).setZero();
  }
  for (const HeldContact& held : held_.all()) set_contact_derivatives(j, held, e, work);

  // By the chain rule: v_j by w_l is h a_jl, q_j by w_l is h^2 (A diag(s) A)_jl, q_j by s_l is h a_jl v_l.
  for (int l = 0; l < n_s; ++l) {
    double twice = 0, squared = 0;
    for (int k = 0; k < n_s; ++k) {
      twice += A(j, k) * e.s[k] * A(k, l);
      squared += A(j, k) * A(k, l);
    }
    auto block = work.K.block(first, l * held_.n_stage(), held_.n_stage(), held_.n_stage());
    block.setZero();
    block.leftCols(n_q) = (e.h * A(j, l)) * R_.v + (e.h * e.h * twice) * R_.q;
    block.col(n_q).noalias() = R_.q.lazyProduct((e.h * A(j, l)) * e.v.col(l));
    if (l == j) {
      block.leftCols(n_q) += R_.w;
      block.col(n_q) += R_.s;
      block.rightCols(held_.n_rows()) = R_.x;
    }
    for (const HeldContact& held : held_.all()) {  // y_j of (6) by w_l
      const int i = held.contact;
      if (!held_.bounces(held)) continue;
      const ContactInfo& contact = info_.contacts[i];
      const double* J = work.J_n.data() + contact.normal_begin;
      for (std::size_t p = 0; p < contact.support.size(); ++p)
        block(held_.row_of(held), contact.support[p]) += auxiliary_.k * e.h * e.h * squared * J[p];
    }
  }
  if (!held_.is_frozen()) {
    auto by_h = work.K.col(work.K.cols() - 1).segment(first, held_.n_stage());
    by_h.noalias() = R_.v.lazyProduct(work.dv_dh.col(j));
    by_h.noalias() += R_.q.lazyProduct(work.dq_dh.col(j));
  }
}

void PseudoTimeEquations::evaluate(PseudoTimeElement& e, double dt, bool with_derivatives, PseudoTimeWorkspace& work) {
  work.load = 0;
  for (int j = 0; j < tableau_.n_s; ++j) {
    set_residual(j, e, work);
    if (with_derivatives) set_derivatives(j, e, work);
  }
  if (held_.is_frozen()) return;
  const Eigen::Index end = work.r.size() - 1;
  work.r[end] = e.h * tableau_.b.dot(e.s) - dt;  // (9)
  if (!with_derivatives) return;
  work.K.row(end).setZero();
  for (int j = 0; j < tableau_.n_s; ++j) work.K(end, j * held_.n_stage() + info_.n_q) = e.h * tableau_.b[j];
  work.K(end, end) = tableau_.b.dot(e.s);
}

void PseudoTimeEquations::set_right_end(PseudoTimeElement& e, PseudoTimeWorkspace& work) const {
  const int n_s = tableau_.n_s;
  const Vector& b = tableau_.b;
  set_stages(e, work);
  e.q1 = e.q0;
  e.v1 = e.v0;
  e.y1 = e.y0;
  for (int j = 0; j < n_s; ++j) {
    e.q1 += (e.h * b[j] * e.s[j]) * e.v.col(j);
    e.v1 += (e.h * b[j]) * e.w.col(j);
  }
  e.Lambda_n.setZero();
  e.Lambda_t.setZero();
  for (const HeldContact& held : held_.all()) {
    const int i = held.contact;
    const ContactInfo& contact = info_.contacts[i];
    const ContactRegion& region = held_.region(held);
    for (int j = 0; j < n_s; ++j) {
      e.Lambda_n[i] += e.h * b[j] * auxiliary_.push[i] * e.beta(i, j);
      for (int d = 0; d < contact.n_t; ++d) {
        double& part = e.tau(contact.tangent_index + d, j);
        if (!region.sticks && !region.slips()) part = 0;
        e.Lambda_t[contact.tangent_index + d] += e.h * b[j] * auxiliary_.push[i] * part;
      }
      if (held_.bounces(held))
        e.y1[i] += e.h * b[j] * packed_dot(contact, work.J_n.data() + contact.normal_begin, e.v.col(j));
    }
  }
}

}  // namespace ricochet
