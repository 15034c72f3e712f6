#include "reference/contact_dynamics.h"

#include <algorithm>
#include <cmath>

#include "reference/force_equations.h"

namespace ricochet::reference {
namespace {

// Residual accelerations, relative to those without forces, above which the forces are corrected.
constexpr double kRefined = 1e-11;

}  // namespace

ContactDynamics::ContactDynamics(const Problem& problem)
    : problem_(problem),
      constant_mass_(problem.info().structure.constant_mass),
      M_(problem.mass_matrix(problem.info().q0)),
      mass_(problem.n_q(), constant_mass_ && problem.info().structure.diagonal_mass),
      modes_(problem.info().contacts.size(), ContactMode::open),
      is_part_(problem.info().contacts.size(), false),
      direction_(Vector::Zero(problem.info().n_lambda_t)),
      holds_direction_(problem.info().contacts.size(), false),
      packed_n_(problem.info().n_normal_entries),
      packed_t_(problem.info().n_tangent_entries),
      push_(problem.n_q()),
      bias_n_(problem.n_c()),
      T_(problem.info().n_lambda_t, problem.n_q()),
      determined_(problem.info().contacts.size(), true) {
  for (const int i : problem.info().bilateral) modes_[i] = ContactMode::closed;
  set_modes(std::vector(modes_));
  mass_.compute(M_);
  ++mass_factorizations;
}

void ContactDynamics::set_modes(const std::vector<ContactMode>& modes) {
  modes_ = modes;
  closed_.clear();
  parts_.clear();
  columns_.clear();
  unknowns_.clear();
  is_affine_ = true;
  follows_velocity_ = has_columns_ = has_equations_ = false;
  for (int i = 0; i < problem_.n_c(); ++i) {
    holds_direction_[i] = false;
    is_part_[i] = is_closed(modes[i]);
    if (!is_part_[i]) continue;
    const auto& contact = problem_.info().contacts[i];
    const int n_t = modes[i] == ContactMode::closed ? 0 : contact.n_t, n_stuck = is_slipping(modes[i]) ? 0 : n_t;
    closed_.push_back(i);
    parts_.push_back({&contact, i, std::ssize(columns_), std::ssize(unknowns_), n_t, n_stuck});
    for (int k = 0; k <= n_t; ++k) {
      const double* J = k == 0 ? packed_n_.data() + contact.normal_begin
                               : packed_t_.data() + contact.tangent_begin + (k - 1) * std::ssize(contact.support);
      columns_.push_back({&contact, J, std::ssize(columns_)});
      if (k <= n_stuck) unknowns_.push_back(columns_.back());
    }
    is_affine_ = is_affine_ && contact.is_affine;
    follows_velocity_ = follows_velocity_ || modes[i] == ContactMode::slip;
    if (is_slipping(modes[i]) && modes[i] != ContactMode::slip) direction_[contact.tangent_index] = slip_sign(modes[i]);
  }
  const Eigen::Index rows = std::ssize(unknowns_);
  MJ_.resize(problem_.n_q(), std::ssize(columns_));
  MC_.resize(problem_.n_q(), rows);
  for (auto* matrix : {&A_, &scaled_}) matrix->resize(rows, rows);
  for (auto* vector : {&diagonal_, &scale_, &right_, &forces_}) vector->resize(rows);
  bias_.setZero(rows);
}

void ContactDynamics::hold_direction(int i, const Vector& d) {
  holds_direction_[i] = d.size() > 0;
  if (d.size() > 0) direction_.segment(problem_.info().contacts[i].tangent_index, d.size()) = d;
  has_equations_ = false;
}

bool ContactDynamics::acceleration(const double* q, const double* v, double* a, double* lambda_n, double* lambda_t) {
  if (!constant_mass_) {
    problem_.mass_matrix(q, M_.data());
    ++mass_factorizations;
    if (!mass_.compute(M_)) return false;
  }
  problem_.force(q, v, problem_.info().u.data(), a);
  ++force_evaluations;
  mass_.solve(a);
  if (parts_.empty()) return true;

  if (!has_columns_) evaluate_columns(q);
  if (!has_equations_) assemble(v);
  has_columns_ = constant_mass_ && is_affine_;
  has_equations_ = has_columns_ && !follows_velocity_;
  if (!is_affine_) evaluate_bias(q, v);
  if (!solve_for_forces(a)) return false;

  for (const Closed& part : parts_) {
    double* tangential = lambda_t + part.info->tangent_index;
    lambda_n[part.contact] = forces_[part.row];
    for (int d = 0; d < part.n_t; ++d) {
      tangential[d] = part.n_stuck > 0
                          ? forces_[part.row + 1 + d]
                          : -part.info->mu * forces_[part.row] * direction_[part.info->tangent_index + d];  // (4)
    }
  }
  return true;
}

/// J and M^-1 J. Contact forces do not push the clock.
void ContactDynamics::evaluate_columns(const double* q) {
  problem_.normal_jacobian_of(is_part_.data(), q, packed_n_.data());
  if (columns_.size() > parts_.size()) problem_.tangent_jacobian_of(is_part_.data(), q, packed_t_.data());
  MJ_.setZero();
  for (const Column& column : columns_) {
    double* MJ = MJ_.col(column.index).data();
    const double* J = column.J;
    for (const int l : column.info->pushed()) MJ[l] = *J++;
    mass_.solve(MJ);
  }
}

/// M^-1 C and the factors of (5).
void ContactDynamics::assemble(const double* v) {
  for (const Closed& part : parts_) {
    MC_.middleCols(part.row, 1 + part.n_stuck) = MJ_.middleCols(part.column, 1 + part.n_stuck);
    if (part.n_t == part.n_stuck) continue;
    double* d = direction_.data() + part.info->tangent_index;
    if (modes_[part.contact] == ContactMode::slip && !holds_direction_[part.contact]) {
      for (int k = 0; k < part.n_t; ++k) d[k] = columns_[part.column + 1 + k].dot(v);
      Eigen::Map<Vector>(d, part.n_t).normalize();
    }
    for (int k = 0; k < part.n_t; ++k) MC_.col(part.row) -= part.info->mu * d[k] * MJ_.col(part.column + 1 + k);  // (4)
  }
  const Eigen::Index n = std::ssize(unknowns_);
  for (Eigen::Index row = 0; row < n; ++row) {
    const Column& R = unknowns_[row];
    diagonal_[row] = R.dot(MJ_.col(R.index).data());
    scale_[row] = 1 / std::sqrt(diagonal_[row]);
    for (Eigen::Index other = 0; other < n; ++other) A_(row, other) = R.dot(MC_.col(other).data());
  }
  for (Eigen::Index other = 0; other < n; ++other) {
    for (Eigen::Index row = 0; row < n; ++row) scaled_(row, other) = scale_[row] * A_(row, other) * scale_[other];
  }
  is_regular_ = factors_.compute(scaled_, kSingular);
}

/// The terms of (2) and (3) without v'; zero for affine contacts.
void ContactDynamics::evaluate_bias(const double* q, const double* v) {
  problem_.gap_acceleration_bias(q, v, bias_n_.data());
  if (unknowns_.size() > parts_.size()) problem_.slip_velocity_derivative(q, v, T_.data());
  for (const Closed& part : parts_) {
    bias_[part.row] = bias_n_[part.contact];
    for (int d = 0; d < part.n_stuck; ++d) {
      double& bias = bias_[part.row + 1 + d] = 0;
      for (const int l : part.info->support) bias += T_(part.info->tangent_index + d, l) * v[l];
    }
  }
}

/// Solves (5) and adds its accelerations to a.
bool ContactDynamics::solve_for_forces(double* a) {
  const Eigen::Index n = std::ssize(unknowns_), n_q = problem_.n_q();
  for (Eigen::Index row = 0; row < n; ++row) right_[row] = -unknowns_[row].dot(a) - bias_[row];
  if (is_regular_ && !is_redundant_) {
    for (Eigen::Index row = 0; row < n; ++row) forces_[row] = scale_[row] * right_[row];
    factors_.solve(forces_.data());
    for (Eigen::Index row = 0; row < n; ++row) forces_[row] *= scale_[row];
  } else if (!divide_forces(a)) {
    return false;
  }
  // The sum is computed first, so that bodies held by contact forces stay at rest to the last bit.
  double* push = push_.data();
  std::fill_n(push, n_q, 0);
  for (Eigen::Index row = 0; row < n; ++row) {
    const double* MC = MC_.col(row).data();
    for (Eigen::Index l = 0; l < n_q; ++l) push[l] += forces_[row] * MC[l];
  }
  for (Eigen::Index l = 0; l < n_q; ++l) a[l] += push[l];
  if (is_regular_ && !is_redundant_ && n > 1) refine_forces(a);
  return true;
}

/// The rounding errors of forces grow with the ratio of masses; the accelerations of the forces show their size.
void ContactDynamics::refine_forces(double* a) {
  const Eigen::Index n = std::ssize(unknowns_), n_q = problem_.n_q();
  const double allowed = kRefined * right_.cwiseAbs().maxCoeff();
  double largest = 0;
  for (Eigen::Index row = 0; row < n; ++row) {
    right_[row] = scale_[row] * (-unknowns_[row].dot(a) - bias_[row]);
    largest = std::max(largest, std::abs(right_[row]) / scale_[row]);
  }
  if (!(largest > allowed)) return;
  factors_.solve(right_.data());
  for (Eigen::Index row = 0; row < n; ++row) {
    const double correction = scale_[row] * right_[row], *MC = MC_.col(row).data();
    forces_[row] += correction;
    for (Eigen::Index l = 0; l < n_q; ++l) a[l] += correction * MC[l];
  }
}

/// Solves (5) if it is singular or was at the last call.
bool ContactDynamics::divide_forces(const double* a) {
  Vector size(right_.size());
  for (Eigen::Index row = 0; row < size.size(); ++row)
    size[row] = packed_terms(*unknowns_[row].info, unknowns_[row].J, a) + std::abs(bias_[row]);
  const ForceEquations equations(A_, diagonal_);
  auto lambda = equations.solve(right_, size);
  if (!lambda) return false;
  if (is_redundant_ || equations.null_space().cols() > 0) {
    if (!equations.determines_motion(M_.diagonal().cwiseSqrt().asDiagonal() * MC_)) return false;
    note_redundancy(equations);
    if (is_redundant_) lambda = steadiest_division(*lambda, equations.null_space(), force_cones());
  }
  forces_ = *lambda;
  return true;
}

/// The cones of closed contacts, in the order of their unknowns.
std::vector<ForceCone> ContactDynamics::force_cones() const {
  std::vector<ForceCone> cones;
  for (const Closed& part : parts_) {
    if (!part.info->is_bilateral) cones.push_back({part.row, part.n_stuck, part.info->mu});
  }
  return cones;
}

void ContactDynamics::note_redundancy(const ForceEquations& equations) {
  is_redundant_ = equations.null_space().cols() > 0;
  for (const Closed& part : parts_) {
    determined_[part.contact] = true;
    for (int k = 0; k <= part.n_stuck; ++k)
      determined_[part.contact] = determined_[part.contact] && equations.determines(part.row + k);
  }
}

}  // namespace ricochet::reference
