#include "reference/contact_dynamics.h"

#include "reference/active_set.h"

namespace ricochet::reference {

ContactDynamics::ContactDynamics(const Problem& problem)
    : problem_(problem),
      constant_mass_(problem.info().structure.constant_mass),
      diagonal_mass_(problem.info().structure.diagonal_mass && constant_mass_) {
  const int n_q = problem.n_q();
  M_ = problem.mass_matrix(problem.info().q0);
  llt_.compute(M_);
  ++mass_factorizations;
  inverse_diagonal_ = M_.diagonal().cwiseInverse();
  f_.resize(n_q);
  packed_.resize(problem.info().n_normal_entries);
  bias_.resize(problem.n_c());
}

bool ContactDynamics::acceleration(const double* q, const double* v, double* a, double* lambda_n) {
  const int n_q = problem_.n_q();
  problem_.force(q, v, problem_.info().u.data(), f_.data());
  ++force_evaluations;
  if (!constant_mass_) {
    problem_.mass_matrix(q, M_.data());
    llt_.compute(M_);
    ++mass_factorizations;
    if (llt_.info() != Eigen::Success) return false;
  }
  Eigen::Map<Vector> acceleration(a, n_q);
  if (diagonal_mass_)
    acceleration = inverse_diagonal_.cwiseProduct(f_);
  else
    acceleration = llt_.solve(f_);
  if (closed_.empty()) return true;

  const auto n = static_cast<Eigen::Index>(closed_.size());
  problem_.normal_jacobian(q, packed_.data());
  problem_.gap_acceleration_bias(q, v, bias_.data());
  Matrix J = Matrix::Zero(n_q, n);
  Vector rhs(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto& contact = problem_.info().contacts[closed_[k]];
    const double* entry = packed_.data() + contact.normal_begin;
    for (const int row : contact.support) J(row, k) = *entry++;
    rhs[k] = -J.col(k).dot(acceleration) - bias_[closed_[k]];
  }
  const Matrix MJ = llt_.solve(J);
  const Eigen::LLT<Matrix> delassus(J.transpose() * MJ);
  if (delassus.info() != Eigen::Success) return false;
  const Vector lambda = delassus.solve(rhs);  // (3)
  acceleration += MJ * lambda;
  for (Eigen::Index k = 0; k < n; ++k) lambda_n[closed_[k]] = lambda[k];
  return true;
}

std::optional<ContactDynamics::Impact> ContactDynamics::impact(const Vector& q, const Vector& v_minus,
                                                               const std::vector<int>& touching) const {
  const Matrix J = problem_.normal_jacobian(q)(Eigen::all, touching);
  const Matrix MJ = problem_.mass_matrix(q).llt().solve(J);
  Vector b = J.transpose() * v_minus;
  for (std::size_t k = 0; k < touching.size(); ++k)
    b[static_cast<Eigen::Index>(k)] *= 1 + problem_.info().contacts[touching[k]].eps_r;
  const auto z = solve_lcp_by_enumeration(J.transpose() * MJ, b);
  if (!z) return std::nullopt;
  Impact impact{v_minus + MJ * *z, Vector::Zero(problem_.n_c())};
  impact.Lambda_n(touching) = *z;
  return impact;
}

std::optional<std::vector<int>> ContactDynamics::closing(const Vector& q, const Vector& v,
                                                         const std::vector<int>& candidates) const {
  const Matrix J = problem_.normal_jacobian(q)(Eigen::all, candidates);
  const Eigen::LLT<Matrix> M(problem_.mass_matrix(q));
  Vector bias(problem_.n_c());
  problem_.gap_acceleration_bias(q.data(), v.data(), bias.data());
  const Vector b = J.transpose() * M.solve(problem_.force(q, v)) + bias(candidates);
  const auto z = solve_lcp_by_enumeration(J.transpose() * M.solve(J), b);
  if (!z) return std::nullopt;
  std::vector<int> closed;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if ((*z)[static_cast<Eigen::Index>(k)] > 0) closed.push_back(candidates[k]);
  }
  return closed;
}

}  // namespace ricochet::reference
