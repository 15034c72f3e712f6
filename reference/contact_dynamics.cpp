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
      contacts_(problem),
      push_(problem.n_q()),
      bias_n_(problem.n_c()),
      T_(problem.info().n_lambda_t, problem.n_q()),
      determined_(problem.info().contacts.size(), true) {
  resize();
  mass_.compute(M_);
  ++mass_factorizations;
}

void ContactDynamics::set_modes(const std::vector<ContactMode>& modes) {
  contacts_.set_modes(modes);
  resize();
}

/// Makes room for the columns and unknowns of the modes.
void ContactDynamics::resize() {
  has_columns_ = has_equations_ = false;
  const Eigen::Index rows = std::ssize(contacts_.unknowns());
  MJ_.resize(problem_.n_q(), std::ssize(contacts_.columns()));
  MC_.resize(problem_.n_q(), rows);
  system_.resize(rows);
  for (auto* vector : {&right_, &forces_}) vector->resize(rows);
  bias_.setZero(rows);
}

void ContactDynamics::hold_direction(int i, const Vector& d) {
  contacts_.hold_direction(i, d);
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
  if (contacts_.parts().empty()) return true;

  if (!has_columns_) evaluate_columns(q);
  if (!has_equations_) assemble(v);
  has_columns_ = constant_mass_ && contacts_.is_affine();
  has_equations_ = has_columns_ && !contacts_.follows_velocity();
  if (!contacts_.is_affine()) evaluate_bias(q, v);
  if (!solve_for_forces(a)) return false;

  for (const ClosedContacts::Part& part : contacts_.parts()) {
    double* tangential = lambda_t + part.info->tangent_index;
    lambda_n[part.contact] = forces_[part.row];
    for (int d = 0; d < part.n_t; ++d) {
      tangential[d] = part.n_stuck > 0 ? forces_[part.row + 1 + d]
                                       : -part.info->mu * forces_[part.row] * contacts_.direction(part)[d];  // (4)
    }
  }
  return true;
}

/// M^-1 J. Contact forces do not act on the clock coordinate.
void ContactDynamics::evaluate_columns(const double* q) {
  contacts_.evaluate(q);
  MJ_.setZero();
  for (const ClosedContacts::Column& column : contacts_.columns()) {
    double* MJ = MJ_.col(column.index).data();
    const double* J = column.J;
    for (const int l : column.info->pushed()) MJ[l] = *J++;
    mass_.solve(MJ);
  }
}

/// M^-1 C and the factors of (5).
void ContactDynamics::assemble(const double* v) {
  contacts_.set_directions(v);
  for (const ClosedContacts::Part& part : contacts_.parts()) {
    MC_.middleCols(part.row, 1 + part.n_stuck) = MJ_.middleCols(part.column, 1 + part.n_stuck);
    if (part.n_t == part.n_stuck) continue;
    const double* d = contacts_.direction(part);
    for (int k = 0; k < part.n_t; ++k) MC_.col(part.row) -= part.info->mu * d[k] * MJ_.col(part.column + 1 + k);  // (4)
  }
  const auto& unknowns = contacts_.unknowns();
  for (Eigen::Index row = 0; row < std::ssize(unknowns); ++row) {
    const ClosedContacts::Column& R = unknowns[row];
    system_.diagonal()[row] = R.dot(MJ_.col(R.index).data());
    for (Eigen::Index other = 0; other < std::ssize(unknowns); ++other)
      system_.A()(row, other) = R.dot(MC_.col(other).data());
  }
  system_.factorize();
}

/// The terms of (2) and (3) without v'; zero for affine contacts.
void ContactDynamics::evaluate_bias(const double* q, const double* v) {
  problem_.gap_acceleration_bias(q, v, bias_n_.data());
  if (contacts_.unknowns().size() > contacts_.parts().size()) problem_.slip_velocity_derivative(q, v, T_.data());
  for (const ClosedContacts::Part& part : contacts_.parts()) {
    bias_[part.row] = bias_n_[part.contact];
    for (int d = 0; d < part.n_stuck; ++d) {
      double& bias = bias_[part.row + 1 + d] = 0;
      for (const int l : part.info->support) bias += T_(part.info->tangent_index + d, l) * v[l];
    }
  }
}

/// Solves (5) and adds its accelerations to a.
bool ContactDynamics::solve_for_forces(double* a) {
  const Eigen::Index n = std::ssize(contacts_.unknowns()), n_q = problem_.n_q();
  for (Eigen::Index row = 0; row < n; ++row) right_[row] = -contacts_.unknowns()[row].dot(a) - bias_[row];
  if (system_.is_regular() && !is_redundant_) {
    for (Eigen::Index row = 0; row < n; ++row) forces_[row] = system_.scale()[row] * right_[row];
    system_.solve_scaled(forces_);
    for (Eigen::Index row = 0; row < n; ++row) forces_[row] *= system_.scale()[row];
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
  if (system_.is_regular() && !is_redundant_ && n > 1) refine_forces(a);
  return true;
}

/// The rounding errors of forces grow with the ratio of masses; the accelerations of the forces show their size.
void ContactDynamics::refine_forces(double* a) {
  const Eigen::Index n = std::ssize(contacts_.unknowns()), n_q = problem_.n_q();
  const double allowed = kRefined * right_.cwiseAbs().maxCoeff();
  double largest = 0;
  for (Eigen::Index row = 0; row < n; ++row) {
    right_[row] = system_.scale()[row] * (-contacts_.unknowns()[row].dot(a) - bias_[row]);
    largest = std::max(largest, std::abs(right_[row]) / system_.scale()[row]);
  }
  if (!(largest > allowed)) return;
  system_.solve_scaled(right_);
  for (Eigen::Index row = 0; row < n; ++row) {
    const double correction = system_.scale()[row] * right_[row], *MC = MC_.col(row).data();
    forces_[row] += correction;
    for (Eigen::Index l = 0; l < n_q; ++l) a[l] += correction * MC[l];
  }
}

/// Solves (5) if it is singular or was at the last call.
bool ContactDynamics::divide_forces(const double* a) {
  Vector size(right_.size());
  for (Eigen::Index row = 0; row < size.size(); ++row)
    size[row] = packed_terms(*contacts_.unknowns()[row].info, contacts_.unknowns()[row].J, a) + std::abs(bias_[row]);
  const ForceEquations equations(system_.A(), system_.diagonal());
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
  for (const ClosedContacts::Part& part : contacts_.parts()) {
    if (!part.info->is_bilateral) cones.push_back({part.row, part.n_stuck, part.info->mu});
  }
  return cones;
}

void ContactDynamics::note_redundancy(const ForceEquations& equations) {
  is_redundant_ = equations.null_space().cols() > 0;
  for (const ClosedContacts::Part& part : contacts_.parts()) {
    determined_[part.contact] = true;
    for (int k = 0; k <= part.n_stuck; ++k)
      determined_[part.contact] = determined_[part.contact] && equations.determines(part.row + k);
  }
}

}  // namespace ricochet::reference
