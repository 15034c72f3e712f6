#include "methods/time_freezing/instant_system.h"

#include <algorithm>

#include "problems/dense_solve.h"

namespace ricochet {

InstantSystem::InstantSystem(const Problem& problem, Counters& counters)
    : problem_(problem), info_(problem.info()), counters_(counters), first_column_(info_.contacts.size(), -1) {
  f_ = load_ = Vector::Zero(info_.n_q);
  gap_bias_ = Vector::Zero(info_.n_c());
  slip_bias_ = Vector::Zero(info_.n_lambda_t);
  J_n_.resize(info_.n_normal_entries);
  J_t_.resize(info_.n_tangent_entries);
  M_.resize(info_.n_q, info_.n_q);
  T_.resize(info_.n_lambda_t, info_.n_q);
}

/// The functions of the scene at the state.
void InstantSystem::evaluate(const Vector& q, const Vector& v) {
  problem_.mass_matrix(q.data(), M_.data());
  problem_.force(q.data(), v.data(), info_.u.data(), f_.data());
  problem_.normal_jacobian(q.data(), J_n_.data());
  problem_.gap_acceleration_bias(q.data(), v.data(), gap_bias_.data());
  if (info_.has_friction()) {
    problem_.tangent_jacobian(q.data(), J_t_.data());
    problem_.slip_velocity_derivative(q.data(), v.data(), T_.data());
    slip_bias_.noalias() = T_.lazyProduct(v);
  }
  ++counters_.force_evaluations;
  ++counters_.mass_factorizations;
}

/// Column k of R and C from packed entries: rates have all of the support, forces what they push.
void InstantSystem::set_column(int contact, const double* J, Eigen::Index k, Matrix& R, Matrix& C) const {
  const ContactInfo& its = info_.contacts[contact];
  for (std::size_t e = 0; e < its.support.size(); ++e) R(its.support[e], k) = J[e];
  for (std::size_t e = 0; e < its.pushed().size(); ++e) C(its.support[e], k) = J[e];
}

/// R, C and the bias of the contacts.
void InstantSystem::set_columns() {
  int n = 0;
  for (const int i : contacts_) {
    first_column_[i] = n;
    n += 1 + n_t(i);
  }
  R_.setZero(info_.n_q, n);
  C_.setZero(info_.n_q, n);
  bias_.resize(n);
  for (const int i : contacts_) {
    const ContactInfo& contact = info_.contacts[i];
    set_column(i, J_n_.data() + contact.normal_begin, column(i), R_, C_);
    bias_[column(i)] = gap_bias_[i];
    for (int d = 0; d < contact.n_t; ++d) {
      const double* J = J_t_.data() + contact.tangent_begin + d * static_cast<int>(contact.support.size());
      set_column(i, J, column(i) + 1 + d, R_, C_);
      bias_[column(i) + 1 + d] = slip_bias_[contact.tangent_index + d];
    }
  }
}

bool InstantSystem::prepare(const Vector& q, const Vector& v, std::span<const int> contacts) {
  contacts_.assign(contacts.begin(), contacts.end());
  evaluate(q, v);
  set_columns();
  const CholeskyFactors mass(M_);
  load_ = mass.solve(f_);
  if (!load_.allFinite()) return false;
  X_ = mass.solve_columns(C_);
  if (info_.has_bilateral()) {  // these constraints answer every force
    const auto n_b = static_cast<Eigen::Index>(info_.bilateral.size());
    Matrix R_b = Matrix::Zero(info_.n_q, n_b), C_b = R_b;
    Vector bias_b(n_b);
    for (int k = 0; k < n_b; ++k) {
      const int i = info_.bilateral[k];
      set_column(i, J_n_.data() + info_.contacts[i].normal_begin, k, R_b, C_b);
      bias_b[k] = gap_bias_[i];
    }
    const Matrix X_b = mass.solve_columns(C_b);
    const Matrix G_b = R_b.transpose() * X_b;
    load_ -= X_b * Vector(solve_partial_pivoting(G_b, R_b.transpose() * load_ + bias_b));
    X_ -= X_b * solve_partial_pivoting(G_b, R_b.transpose() * X_);
    if (!load_.allFinite()) return false;
  }
  G_ = R_.transpose() * X_;
  return true;
}

double InstantSystem::normal_velocity(int contact, const Vector& v) const {
  return R_.col(column(contact)).dot(v);
}

void InstantSystem::slip_velocity(int contact, const Vector& v, double* v_t) const {
  for (int d = 0; d < n_t(contact); ++d) v_t[d] = R_.col(column(contact) + 1 + d).dot(v);
}

double InstantSystem::normal_terms(int contact, const Vector& x) const {
  return R_.col(column(contact)).cwiseAbs().dot(x.cwiseAbs());
}

double InstantSystem::tangent_terms(int contact, const Vector& x) const {
  double size = 0;
  for (int d = 0; d < n_t(contact); ++d)
    size = std::max(size, R_.col(column(contact) + 1 + d).cwiseAbs().dot(x.cwiseAbs()));
  return size;
}

double InstantSystem::normal_delassus(int contact) const {
  return G_(column(contact), column(contact));
}

double InstantSystem::tangential_delassus(int contact) const {
  double size = 0;
  for (int d = 1; d <= n_t(contact); ++d) size = std::max(size, G_(column(contact) + d, column(contact) + d));
  return size;
}

const double* InstantSystem::normal(int contact) const {
  return J_n_.data() + info_.contacts[contact].normal_begin;
}

double InstantSystem::load_rate(int contact) const {
  return R_.col(column(contact)).dot(load_) + bias_[column(contact)];
}

}  // namespace ricochet
